"""Files by their content, and the register of which are needed."""
