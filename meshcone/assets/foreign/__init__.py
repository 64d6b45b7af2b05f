"""PLY, STL and OFF: polygons, and what their vertices and faces carry.

Read here rather than by trimesh, which trusts declared sizes, has no place to name in what it
refuses, and (5.2) reads a binary PLY of triangles and quads as garbage where their sizes happen
to add up, and an ASCII STL without its last line as empty. The tests compare with trimesh.
"""

from meshcone.assets.foreign.asset import ForeignAsset, read_foreign, recognise_foreign

__all__ = ["ForeignAsset", "read_foreign", "recognise_foreign"]
