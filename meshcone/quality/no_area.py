"""Faces without area, as far as the numbers of their file tell.

A corner that lies on the opposite side is written next to it: a face without area comes back as
a needle whose height is rounding. What that is depends on the file, not on the numbers here.
"""

from __future__ import annotations

import numpy as np

from meshcone.surface import Mesh
from meshcone.surface.arrays import Bools, differences, row_dot

_ROUNDING = 1e-14  # of a float64: area over the square of the longest side
# Height over the longest side. What is thicker has a shape, however coarse the numbers are.
_NEEDLE = 0.01
# Heights of a whole step of the file are no rounding of 0: a plate may be one step thick.
_STEP = 1 - 1e-6


def without_area(mesh: Mesh) -> Bools:
    """Find the faces of a mesh that have no area, (m,).

    These are needles less high than one step of the numbers that their file can hold there.
    """
    faces = mesh.faces
    sides = [differences(mesh.vertices, faces[:, pair]) for pair in ([0, 1], [1, 2], [2, 0])]
    squared = np.max([row_dot(side, side) for side in sides], axis=0)
    flat: Bools = ~(mesh.face_areas > _ROUNDING * squared)
    if mesh.precision is not None:
        longest = np.sqrt(squared)
        least = np.minimum(_STEP * mesh.precision[faces].max(axis=1), _NEEDLE * longest)
        flat |= 2 * mesh.face_areas < longest * least
    return flat
