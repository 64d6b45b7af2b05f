"""Faces held from turning over: m_f·A_f(X) ≥ h_f, to first order.

A face's doubled area vector A(X) = (b − a)×(c − a) is a form of degree two in its corners. Its
part along a fixed direction m, linearised at the corners where a round starts, is a half-space.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy import sparse

from meshcone.program.cones.base import ConeFamily, ConeType
from meshcone.surface import Mesh
from meshcone.surface.arrays import Bools, Floats, Ints, row_dot

# A face may turn until this share of its area is left along its direction; one that starts
# with less may lose half of that, so that there is room between the start and the bound.
_AREA_LEFT, _OF_LITTLE = 0.1, 0.5


@dataclass(frozen=True)
class Orientation(ConeFamily):
    """One linear row per face: g_a·a + g_b·b + g_c·c − h ≥ 0, divided by the face's size.

    Where the round starts every slack is positive: these alone never contradict each other.

    Attributes:
        vertices: (k, 3) the faces' corners.
        gradients: (k, 3, 3) g: of m·A in each corner, over the square root of |A|.
        bounds: (k,) h, likewise; a length, as the slack is.
        sizes: (k,) the square root of |A| where the round starts.
    """

    kind: ClassVar[str] = "orientation"
    cone: ClassVar[ConeType] = "linear"
    dimension: ClassVar[int] = 1

    vertices: Ints
    gradients: Floats
    bounds: Floats
    sizes: Floats

    @staticmethod
    def at(moving: Mesh, directions: Floats, held: Bools) -> Orientation:
        """Hold faces to the side they are on.

        Args:
            moving: the mesh where the round starts.
            directions: (m, 3) unit normals, one for each of its faces.
            held: (m,) which faces to hold; those without area along their direction are not.
        """
        along = row_dot(moving.doubled_area_vectors, directions)
        faces = np.flatnonzero(held & (along > 0))
        directions, along = directions[faces], along[faces]
        a, b, c = np.moveaxis(moving.corners[faces], 1, 0)
        areas = 2 * moving.face_areas[faces]
        sizes = np.sqrt(areas)
        opposite = np.stack([c - b, a - c, b - a], axis=1)
        floors = np.minimum(_AREA_LEFT * areas, _OF_LITTLE * along)
        return Orientation(
            vertices=moving.faces[faces],
            gradients=np.cross(directions[:, None], opposite) / sizes[:, None, None],
            # By Euler's theorem the gradient times the corners is twice the form itself.
            bounds=(along + floors) / sizes,
            sizes=sizes,
        )

    def slack(self, positions: Floats) -> Floats:
        """See :meth:`ConeFamily.slack`."""
        moved = np.einsum("fcd,fcd->f", self.gradients, positions[self.vertices])
        return np.asarray((moved - self.bounds)[:, None])

    def tightness(self, positions: Floats) -> Floats:
        """See :meth:`ConeFamily.tightness`; relative to the face's size."""
        return -self.slack(positions)[:, 0] / self.sizes

    def rows(self, which: Ints, vertex_count: int) -> tuple[sparse.csr_array, Floats]:
        """See :meth:`ConeFamily.rows`."""
        columns = (3 * self.vertices[which][:, :, None] + np.arange(3)).ravel()
        offsets = np.arange(0, 9 * len(which) + 1, 9)
        data = (-self.gradients[which].ravel(), columns, offsets)
        matrix = sparse.csr_array(data, shape=(len(which), 3 * vertex_count))
        return matrix, -self.bounds[which]
