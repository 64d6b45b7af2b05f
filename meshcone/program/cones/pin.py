"""Vertices held where they are: x_i = v_i."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from scipy import sparse

from meshcone.program.cones.base import ConeFamily, ConeType, coordinate_rows
from meshcone.surface.arrays import Floats, Ints


@dataclass(frozen=True)
class Pins(ConeFamily):
    """Three rows in the zero cone per vertex.

    Attributes:
        vertices: (k, 1) the vertices.
        centres: (k, 3) where they stay.
    """

    kind: ClassVar[str] = "pin"
    cone: ClassVar[ConeType] = "zero"
    dimension: ClassVar[int] = 3

    vertices: Ints
    centres: Floats

    @staticmethod
    def at(positions: Floats, vertices: Ints) -> Pins:
        """Pin the chosen vertices (k,) of (n, 3) positions where they are."""
        return Pins(vertices[:, None], positions[vertices])

    def slack(self, positions: Floats) -> Floats:
        """See :meth:`ConeFamily.slack`."""
        return positions[self.vertices[:, 0]] - self.centres

    def rows(self, which: Ints, vertex_count: int) -> tuple[sparse.csr_array, Floats]:
        """See :meth:`ConeFamily.rows`."""
        matrix = coordinate_rows(self.vertices[which, 0], vertex_count, stride=3, offset=0)
        return matrix, -self.centres[which].ravel()
