"""Constraint kinds, one file each."""

from meshcone.program.cones.base import ConeFamily, ConeType, cone_violation
from meshcone.program.cones.edge_cap import EdgeCaps

__all__ = ["ConeFamily", "ConeType", "EdgeCaps", "cone_violation"]
