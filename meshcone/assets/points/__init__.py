"""Points without faces, as scanners give them."""

from meshcone.assets.points.asset import PointAsset
from meshcone.assets.points.xyz import read_xyz

__all__ = ["PointAsset", "read_xyz"]
