"""Caps on edge lengths: ‖x_i − x_j‖ ≤ δ_ij (the paper's constraint)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy import sparse

from meshcone.program.cones.base import ConeFamily, ConeType
from meshcone.surface.arrays import Floats, Ints, differences, row_lengths
from meshcone.surface.mesh import Mesh


@dataclass(frozen=True)
class EdgeCaps(ConeFamily):
    """One second-order cone (δ, x_i − x_j) per edge.

    Attributes:
        vertices: (k, 2) the edges.
        caps: (k,) their caps δ.
    """

    kind: ClassVar[str] = "edge_cap"
    cone: ClassVar[ConeType] = "second_order"
    dimension: ClassVar[int] = 4

    vertices: Ints
    caps: Floats

    @staticmethod
    def uniform(mesh: Mesh, cap: float) -> EdgeCaps:
        """Cap every edge of the mesh at the same length, as the paper does."""
        return EdgeCaps(mesh.edges, np.full(len(mesh.edges), cap))

    @staticmethod
    def relative(mesh: Mesh, factor: float) -> EdgeCaps:
        """Cap each edge at a multiple of the input's: the longest at either end, or the mean.

        The longer of the two counts, so that a part whose edges have shrunk, as over-smoothing
        shrinks them, may grow back. With a factor of at least one the input itself is feasible.
        """
        longest = np.zeros(len(mesh.vertices))
        np.maximum.at(longest, mesh.edges.ravel(), np.repeat(mesh.edge_lengths, 2))
        typical = mesh.edge_lengths.mean() if len(mesh.edges) else 0.0
        return EdgeCaps(mesh.edges, factor * np.maximum(longest[mesh.edges].max(axis=1), typical))

    def slack(self, positions: Floats) -> Floats:
        """See :meth:`ConeFamily.slack`."""
        return np.concatenate([self.caps[:, None], differences(positions, self.vertices)], axis=1)

    def violation(self, positions: Floats) -> Floats:
        """See :meth:`ConeFamily.violation`; every round asks it of every edge."""
        excess = row_lengths(differences(positions, self.vertices)) - self.caps
        return np.asarray(np.maximum(excess, 0))

    def rows(self, which: Ints, vertex_count: int) -> tuple[sparse.csr_array, Floats]:
        """See :meth:`ConeFamily.rows`."""
        count = len(which)
        tips = (4 * np.arange(count)[:, None] + np.arange(1, 4)).ravel()
        first = (3 * self.vertices[which, 0, None] + np.arange(3)).ravel()
        second = (3 * self.vertices[which, 1, None] + np.arange(3)).ravel()
        values = np.concatenate([np.full(3 * count, -1.0), np.full(3 * count, 1.0)])
        index = (np.concatenate([tips, tips]), np.concatenate([first, second]))
        matrix = sparse.coo_array((values, index), shape=(4 * count, 3 * vertex_count)).tocsr()
        bound = np.zeros(4 * count)
        bound[::4] = self.caps[which]
        return matrix, bound
