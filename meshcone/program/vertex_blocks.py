"""Symmetric 3×3 blocks, one for each vertex: the preconditioner of every linear solve here.

A vertex that is held to a plane moves freely within it, so what couples its three
coordinates is strong and a plain diagonal says nothing of it. With the blocks on the
diagonal of P inverted, CG needs a third of the iterations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from meshcone.surface.arrays import Floats, Ints

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

    def __add__(self, other: VertexBlocks) -> VertexBlocks:
        """Add block by block."""
        return VertexBlocks(self.entries + other.entries)

    def plus_isotropic(self, values: Floats) -> VertexBlocks:
        """Add v I to each block, for (n,) values or one."""
        entries = self.entries.copy()
        entries[:, :3] += values[..., None]
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


class CongruenceBlocks:
    """The diagonal blocks of AᵀVA, for one A and many V with the same pattern.

    Args:
        A: (m, 3n), with few entries in a row.
        pattern: (m, m) a V; the entries of the others stand at the same places.
    """

    def __init__(self, A: sparse.csr_array, pattern: sparse.csr_array) -> None:
        columns, values = _padded(A)
        entry = np.arange(pattern.nnz)
        left, right = pattern.tocoo().coords
        touching = (columns[left] >= 0).any(axis=1) & (columns[right] >= 0).any(axis=1)
        entry, left, right = entry[touching], left[touching], right[touching]
        first, second = columns[left][:, :, None], columns[right][:, None, :]
        # A block is symmetric: one of its two triangles says all.
        kept = (first >= 0) & (first // 3 == second // 3) & (first <= second)
        place = 6 * (first // 3) + _FULL[first % 3, second % 3]
        self._place = np.broadcast_to(place, kept.shape)[kept]
        self._factor = (values[left][:, :, None] * values[right][:, None, :])[kept]
        self._entry = np.broadcast_to(entry[:, None, None], kept.shape)[kept]
        self._size = 2 * A.shape[1]

    def of(self, V: sparse.csr_array) -> VertexBlocks:
        """Return the blocks (n of them) for a V of the pattern."""
        products = self._factor * V.data[self._entry]
        entries = np.bincount(self._place, products, self._size).astype(np.float64)
        return VertexBlocks(entries.reshape(-1, 6))


def _padded(A: sparse.csr_array) -> tuple[Ints, Floats]:
    """Return columns and values of each row as (m, w), where a row is shorter −1 and 0."""
    lengths = np.diff(A.indptr)
    row = np.repeat(np.arange(A.shape[0]), lengths)
    place = np.arange(A.nnz) - np.repeat(A.indptr[:-1], lengths)
    shape = (A.shape[0], int(lengths.max(initial=0)))
    columns, values = np.full(shape, -1, dtype=np.int64), np.zeros(shape)
    columns[row, place], values[row, place] = A.indices, A.data
    return columns, values
