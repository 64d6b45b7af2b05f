"""Constraint kinds, one file each."""

from meshcone.program.cones.band import ToleranceBand
from meshcone.program.cones.base import FEASIBILITY, ConeFamily, ConeType, cone_violation
from meshcone.program.cones.displacement import DisplacementCaps
from meshcone.program.cones.edge_cap import EdgeCaps
from meshcone.program.cones.one_side import (
    OneSide,
    StayingEdges,
    StayingFaces,
    StayingVertices,
)
from meshcone.program.cones.orientation import Orientation
from meshcone.program.cones.pin import Pins
from meshcone.program.cones.tie import EdgeTies

__all__ = [
    "FEASIBILITY",
    "ConeFamily",
    "ConeType",
    "DisplacementCaps",
    "EdgeCaps",
    "EdgeTies",
    "OneSide",
    "Orientation",
    "Pins",
    "StayingEdges",
    "StayingFaces",
    "StayingVertices",
    "ToleranceBand",
    "cone_violation",
]
