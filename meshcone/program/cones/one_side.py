"""Points held on one side of the reference: n_i·(c_i − p_i) ≥ o_i, c_i a mean of vertices."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy import sparse

from meshcone.program.cones.base import ConeFamily, ConeType
from meshcone.surface.arrays import Floats, Ints, row_dot

# Of the radius. A slack below a fiftieth of it is about to be used up.
_SMALL = 0.05


@dataclass(frozen=True)
class OneSide(ConeFamily):
    """One linear row per point: n_i·(c_i − p_i) − o_i ≥ 0.

    p_i and n_i are the closest reference point in this round and its normal, turned to the side
    to stay on.

    Attributes:
        vertices: (k, v) the vertices whose mean each point c is.
        points: (k, 3) p.
        normals: (k, 3) n, unit; or 0 where nothing is asked of a point in this round.
        offsets: (k,) o.
    """

    cone: ClassVar[ConeType] = "linear"
    dimension: ClassVar[int] = 1

    vertices: Ints
    points: Floats
    normals: Floats
    offsets: Floats

    def slack(self, positions: Floats) -> Floats:
        """See :meth:`ConeFamily.slack`."""
        apart = positions[self.vertices].mean(axis=1) - self.points
        return np.asarray(row_dot(self.normals, apart) - self.offsets)[:, None]

    def tightness(self, positions: Floats) -> Floats:
        """See :meth:`ConeFamily.tightness`; a single row has no middle to compare with."""
        return np.asarray(-self.slack(positions)[:, 0] / np.maximum(self.offsets, _SMALL))

    def rows(self, which: Ints, vertex_count: int) -> tuple[sparse.csr_array, Floats]:
        """See :meth:`ConeFamily.rows`."""
        normals, vertices = self.normals[which], self.vertices[which]
        width = vertices.shape[1]
        values = np.repeat(-normals[:, None, :] / width, width, axis=1)
        columns = 3 * vertices[:, :, None] + np.arange(3)
        offsets = np.arange(len(which) + 1) * (3 * width)
        shape = (len(which), 3 * vertex_count)
        matrix = sparse.csr_array((values.ravel(), columns.ravel(), offsets), shape=shape)
        return matrix, -(row_dot(normals, self.points[which]) + self.offsets[which])


class StayingVertices(OneSide):
    """Vertices on one side."""

    kind: ClassVar[str] = "stay"


class StayingEdges(OneSide):
    """Middles of edges on one side."""

    kind: ClassVar[str] = "stay_on_edges"


class StayingFaces(OneSide):
    """Centres of faces on one side."""

    kind: ClassVar[str] = "stay_on_faces"
