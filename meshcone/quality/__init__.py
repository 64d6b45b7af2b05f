"""How good a mesh is, against a reference and by itself."""
