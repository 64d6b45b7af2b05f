"""Caps on how far a vertex may move: ‖x_i − v_i‖ ≤ r."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy import sparse

from meshcone.program.cones.base import ConeFamily, ConeType, coordinate_rows
from meshcone.surface.arrays import Floats, Ints


@dataclass(frozen=True)
class DisplacementCaps(ConeFamily):
    """One second-order cone (r, x_i − v_i) per vertex.

    Attributes:
        vertices: (k, 1) the vertices.
        centres: (k, 3) where they were.
        caps: (k,) how far they may go.
    """

    kind: ClassVar[str] = "max_displacement"
    cone: ClassVar[ConeType] = "second_order"
    dimension: ClassVar[int] = 4

    vertices: Ints
    centres: Floats
    caps: Floats

    @staticmethod
    def uniform(positions: Floats, cap: float) -> DisplacementCaps:
        """Cap every vertex of (n, 3) positions at the same distance from where it is."""
        count = len(positions)
        return DisplacementCaps(np.arange(count)[:, None], positions, np.full(count, cap))

    def slack(self, positions: Floats) -> Floats:
        """See :meth:`ConeFamily.slack`."""
        moved = positions[self.vertices[:, 0]] - self.centres
        return np.concatenate([self.caps[:, None], moved], axis=1)

    def rows(self, which: Ints, vertex_count: int) -> tuple[sparse.csr_array, Floats]:
        """See :meth:`ConeFamily.rows`."""
        matrix = coordinate_rows(self.vertices[which, 0], vertex_count, stride=4, offset=1)
        bound = np.concatenate([self.caps[which, None], -self.centres[which]], axis=1)
        return matrix, bound.ravel()
