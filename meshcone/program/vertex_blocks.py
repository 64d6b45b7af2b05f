"""Symmetric 3×3 blocks, one for each vertex: the preconditioner of every linear solve here.

A vertex that is held to a plane moves freely within it, so what couples its three
coordinates is strong and a plain diagonal says nothing of it. With the blocks on the
diagonal of P inverted, CG needs a third of the iterations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from meshcone.surface.arrays import Floats

# The entries kept of each block, as rows and columns; the others follow from symmetry.
_ROWS = np.array([0, 1, 2, 0, 0, 1])
_COLUMNS = np.array([0, 1, 2, 1, 2, 2])
_FULL = np.array([[0, 3, 4], [3, 1, 5], [4, 5, 2]])


@dataclass(frozen=True)
class VertexBlocks:
    """A block diagonal matrix of 3n rows.

    Attributes:
        entries: (n, 6) the entries xx, yy, zz, xy, xz, yz of each block.
    """

    entries: Floats

    @staticmethod
    def of_planes(weights: Floats, normals: Floats, tangential: float) -> VertexBlocks:
        """Write w (n nᵀ + τ I) for (k,) weights and (k, 3) normals."""
        entries = weights[:, None] * normals[:, _ROWS] * normals[:, _COLUMNS]
        entries[:, :3] += (tangential * weights)[:, None]
        return VertexBlocks(entries)

    @staticmethod
    def diagonal_of(matrix: sparse.csr_array) -> VertexBlocks:
        """Take the diagonal blocks of a sparse symmetric matrix (3n, 3n)."""
        listed = matrix.tocoo()
        rows, columns = listed.coords
        entry = _FULL[rows % 3, columns % 3]
        kept = (rows // 3 == columns // 3) & (rows <= columns)
        place = 6 * (rows[kept] // 3) + entry[kept]
        count = 2 * matrix.shape[0]
        entries = np.bincount(place, listed.data[kept], count).astype(np.float64)
        return VertexBlocks(entries.reshape(-1, 6))

    def __add__(self, other: VertexBlocks) -> VertexBlocks:
        """Add block by block."""
        return VertexBlocks(self.entries + other.entries)

    def scaled(self, factor: float) -> VertexBlocks:
        """Multiply every block by a number."""
        return VertexBlocks(factor * self.entries)

    def plus_isotropic(self, values: Floats) -> VertexBlocks:
        """Add v I to each block, for (n,) values."""
        entries = self.entries.copy()
        entries[:, :3] += values[:, None]
        return VertexBlocks(entries)

    def mean_diagonal(self) -> float:
        """Return the mean of the 3n diagonal entries."""
        return float(self.entries[:, :3].mean())

    def inverse(self) -> VertexBlocks:
        """Invert every block, each positive definite, by its adjugate."""
        xx, yy, zz, xy, xz, yz = self.entries.T
        adjugate = np.stack(
            [
                yy * zz - yz * yz,
                xx * zz - xz * xz,
                xx * yy - xy * xy,
                xz * yz - xy * zz,
                xy * yz - xz * yy,
                xy * xz - xx * yz,
            ],
            axis=1,
        )
        determinant = xx * adjugate[:, 0] + xy * adjugate[:, 3] + xz * adjugate[:, 4]
        return VertexBlocks(adjugate / determinant[:, None])

    def full(self) -> Floats:
        """Return the blocks as (n, 3, 3)."""
        return self.entries[:, _FULL]
