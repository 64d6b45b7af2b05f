"""Many pairs of meshes held against gates: what ``meshcone gate`` is made of."""
