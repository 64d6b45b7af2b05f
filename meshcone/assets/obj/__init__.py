"""Wavefront OBJ: a reader and writer that work on the file's own lines."""

from meshcone.assets.obj.asset import ObjAsset, read_obj

__all__ = ["ObjAsset", "read_obj"]
