"""Files and the surfaces in them."""
