"""Sets of gates for common uses, as gate files that people can copy."""
