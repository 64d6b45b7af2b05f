"""Vertices held on the edges of another border that they lie on: x_v = (1 − t) x_a + t x_b + o."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy import sparse

from meshcone.program.cones.base import ConeFamily, ConeType
from meshcone.surface.arrays import Floats, Ints


@dataclass(frozen=True)
class EdgeTies(ConeFamily):
    """Three rows in the zero cone for each vertex.

    Attributes:
        vertices: (k, 3) the vertex and the ends of its edge, or two others that it follows.
        shares: (k,) t, where between them it lies.
        offsets: (k, 3) o, how it lies off that place in the input.
    """

    kind: ClassVar[str] = "seam"
    cone: ClassVar[ConeType] = "zero"
    dimension: ClassVar[int] = 3

    vertices: Ints
    shares: Floats
    offsets: Floats

    @staticmethod
    def at(positions: Floats, vertices: Ints, edges: Ints, shares: Floats) -> EdgeTies:
        """Tie (k,) vertices to places on (k, 2) edges as they lie at (n, 3) positions."""
        start, end = positions[edges[:, 0]], positions[edges[:, 1]]
        offsets = positions[vertices] - start - shares[:, None] * (end - start)
        return EdgeTies(np.column_stack([vertices, edges]), shares, offsets)

    def slack(self, positions: Floats) -> Floats:
        """See :meth:`ConeFamily.slack`."""
        vertex, start, end = (positions[each] for each in self.vertices.T)
        return np.asarray(vertex - start - self.shares[:, None] * (end - start) - self.offsets)

    def rows(self, which: Ints, vertex_count: int) -> tuple[sparse.csr_array, Floats]:
        """See :meth:`ConeFamily.rows`."""
        columns = 3 * self.vertices[which][:, None, :] + np.arange(3)[:, None]
        share = self.shares[which]
        entries = np.stack([np.full(len(which), -1.0), 1 - share, share], axis=1)
        data = np.broadcast_to(entries[:, None, :], columns.shape)
        starts = np.arange(0, columns.size + 1, 3)
        shape = (3 * len(which), 3 * vertex_count)
        matrix = sparse.csr_array((data.ravel(), columns.ravel(), starts), shape=shape)
        return matrix, -self.offsets[which].ravel()
