"""Two meshes moved to where the arithmetic of this room is accurate, and its rounding bounded.

Everything that is proven here is proven up to one number, :attr:`Placed.rounding`, which is
2⁻⁴² (2.3e-13) of the largest coordinate after placing. Let s be that coordinate and
u = 2⁻⁵³ the unit roundoff of IEEE double precision. In units of u·s, an upper bound can be
too low by at most

========  ==========================================================================
   11     placing: each coordinate of a vertex is rounded once here, √3 for either mesh,
          and may have been rounded twice on its way into the frame
 1740     cutting: the point where an edge of a piece is cut is off by 5√3, whatever
          the piece. A corner that is off by δ moves no point of a piece by more than
          δ, and what the cuts above a piece have moved adds up, over at most 200 cuts
   32     a distance: 10√3 for the differences and products that lead to the vector
          from point to foot, 2√3 because the foot's weights may add up to 1 + u, 3 u
          of at most 2√3 s for its length
   14     mixing up to four distances: 4 u of at most 2√3 s; their weights are whole
          numbers of 2⁻²⁴ and add up to 1 exactly
========  ==========================================================================

1797 in all, where 2048 are allowed. A lower bound needs fewer: 11 for placing, 9 for a point
computed from a face's corners and 28 for heights over a supporting plane. Scaling is by a
power of two, which is exact.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from meshcone.errors import InputError
from meshcone.surface import Mesh
from meshcone.surface.arrays import Floats

# Cuts above a piece; the derivation above rests on it.
MOST_CUTS_DEEP = 200
_ROUNDING = 2.0**-42


@dataclass(frozen=True)
class Placed:
    """Two meshes, moved by one vector and scaled by one power of two.

    The centre of the reference's bounding box is at the origin and the largest coordinate
    of either mesh is between ½ and 1.

    Attributes:
        mesh, reference: the meshes; a vertex that no face uses is at the origin.
        origin: (3,) what has become the origin, in the meshes' unit.
        unit: what has become 1, in the meshes' unit.
        rounding: bound on all rounding, in the meshes' unit.
    """

    mesh: Mesh
    reference: Mesh
    origin: Floats
    unit: float

    @property
    def rounding(self) -> float:
        """Bound on all rounding, relative to :attr:`unit`."""
        return _ROUNDING

    @staticmethod
    def of(mesh: Mesh, reference: Mesh) -> Placed:
        """Place two meshes in one unit.

        Raises:
            InputError: a mesh has no faces, or a position that is not finite.
        """
        for each, name in ((mesh, "mesh"), (reference, "reference")):
            if not len(each.faces):
                raise InputError(f"the {name} has no faces: there is nothing to measure")
            if not np.isfinite(each.vertices[each.used_vertices]).all():
                raise InputError(f"the {name} has a position that is not finite")
        there = reference.vertices[reference.used_vertices]
        low, high = there.min(axis=0), there.max(axis=0)
        origin = low + (high - low) / 2
        moved = [_used_only(each, each.vertices - origin) for each in (mesh, reference)]
        largest = max(float(np.abs(vertices).max()) for vertices in moved)
        unit = float(2.0 ** np.frexp(largest)[1]) if largest > 0 else 1.0
        placed, other = (
            Mesh(vertices / unit, each.faces)
            for vertices, each in zip(moved, (mesh, reference), strict=True)
        )
        return Placed(placed, other, origin, unit)


def _used_only(mesh: Mesh, vertices: Floats) -> Floats:
    kept = np.zeros_like(vertices)
    kept[mesh.used_vertices] = vertices[mesh.used_vertices]
    return kept
