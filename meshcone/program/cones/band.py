"""A tolerance band around the reference: |n_i·(x_i − p_i)| ≤ t."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy import sparse

from meshcone.program.cones.base import ConeFamily, ConeType
from meshcone.surface.arrays import Floats, Ints, row_dot


@dataclass(frozen=True)
class ToleranceBand(ConeFamily):
    """Two linear rows per vertex: t ∓ n_i·(x_i − p_i) ≥ 0.

    p_i and n_i are the closest reference point and its normal in this round.

    Attributes:
        vertices: (k, 1) the vertices.
        points: (k, 3) p.
        normals: (k, 3) n, unit.
        half_width: t.
    """

    kind: ClassVar[str] = "tolerance_band"
    cone: ClassVar[ConeType] = "linear"
    dimension: ClassVar[int] = 2

    vertices: Ints
    points: Floats
    normals: Floats
    half_width: float

    def slack(self, positions: Floats) -> Floats:
        """See :meth:`ConeFamily.slack`."""
        height = row_dot(self.normals, positions[self.vertices[:, 0]] - self.points)
        return np.stack([self.half_width - height, self.half_width + height], axis=1)

    def rows(self, which: Ints, vertex_count: int) -> tuple[sparse.csr_array, Floats]:
        """See :meth:`ConeFamily.rows`."""
        normals = self.normals[which]
        columns = 3 * self.vertices[which] + np.arange(3)
        values = np.stack([normals, -normals], axis=1)
        index = np.stack([columns, columns], axis=1)
        offsets = np.arange(0, 6 * len(which) + 1, 3)
        matrix = sparse.csr_array(
            (values.ravel(), index.ravel(), offsets), shape=(2 * len(which), 3 * vertex_count)
        )
        height = row_dot(normals, self.points[which])
        bound = np.stack([self.half_width + height, self.half_width - height], axis=1)
        return matrix, bound.ravel()
