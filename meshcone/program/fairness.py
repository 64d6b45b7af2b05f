"""Fairness: what holds the vertices of a mesh together where the data say nothing.

    Σ_i (L X − T)_iᵀ W_i (L X − T)_i,   W_i = b_i I + o_i (I − n_i n_iᵀ)

L X is how far each vertex lies from the mean of its neighbours. Where T is zero, fairness
smooths positions. Where T is what L makes of the input, it smooths displacements: the
vertices move with their neighbours and keep their shape. A border asks for one across the
surface and the other within it, or its outline would melt.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from meshcone.program.fused import add_smoothed, add_smoothed_blocks
from meshcone.program.vertex_blocks import VertexBlocks
from meshcone.surface.arrays import Floats, Ints32, row_dot


@dataclass(frozen=True)
class Fairness:
    """One round's fairness.

    Attributes:
        laplacian: (n, n) L, uniform: each vertex minus the mean of its neighbours.
        weights: (n,) b ≥ 0.
        outline: (n,) o ≥ 0, what is added within the tangent plane.
        normals: (n, 3) n, unit normals of the tangent planes.
        rest: (n, 3) T.
    """

    laplacian: sparse.csr_array
    weights: Floats
    outline: Floats
    normals: Floats
    rest: Floats

    def apply(self, positions: Floats) -> Floats:
        """Return Lᵀ W L X for (n, 3) positions."""
        result = np.zeros_like(positions)
        self.add_to(result, positions)
        return result

    def add_to(self, result: Floats, positions: Floats) -> None:
        """Add Lᵀ W L X to (n, 3) numbers."""
        rows = self._rows
        add_smoothed(positions, *rows, self.weights, self.outline, self.normals, result)

    @cached_property
    def pulled(self) -> Floats:
        """Lᵀ W T, (n, 3)."""
        return np.asarray(self.laplacian.T @ self._weighted(self.rest))

    @property
    def value_at_zero(self) -> float:
        """The fairness where every vertex is at the origin."""
        return float(np.sum(self.rest * self._weighted(self.rest)))

    def add_blocks_to(self, entries: Floats) -> None:
        """Add the 3×3 blocks on the diagonal of Lᵀ W L to (n, 6) entries of such blocks."""
        add_smoothed_blocks(*self._rows, self.weights, self.outline, self.normals, entries)

    def _weighted(self, vectors: Floats) -> Floats:
        result = (self.weights + self.outline)[:, None] * vectors
        if self.outline.any():
            across = self.outline * row_dot(self.normals, vectors)
            result -= across[:, None] * self.normals
        return np.asarray(result)

    @property
    def _rows(self) -> tuple[Ints32, Ints32, Floats]:
        return self.laplacian.indptr, self.laplacian.indices, self.laplacian.data

    @property
    def blocks(self) -> VertexBlocks:
        """The blocks of W."""
        across = VertexBlocks.of_planes(-self.outline, self.normals, 0.0)
        return across.plus_isotropic(self.weights + self.outline)
