"""Matrices Fᵀ W F, where each row of F is of whole vertices and W has a 3×3 block for it.

A row says which vertices a pull or a fairness acts on, and by which share on each. One pass over
the rows at each vertex does without the matrices over all coordinates that W and F would be.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from meshcone.program.vertex_blocks import VertexBlocks
from meshcone.surface.arrays import Floats, Ints32
from meshcone.surface.compiled import compiled

_SPARSE = "int32[::1], int32[::1], float64[::1]"
_PLACES = "int32[::1]"


def coupled_blocks(factor: sparse.csr_array, weights: VertexBlocks) -> sparse.bsr_array:
    """Return Fᵀ W F, (3n, 3n) in 3×3 blocks, symmetric to the last bit and sorted.

    Args:
        factor: F, (r, n).
        weights: W, r blocks.
    """
    count = factor.shape[1]
    most = int((np.diff(factor.indptr).astype(np.int64) ** 2).sum())
    turned = sparse.csr_array(factor.T)
    rows = factor.indptr, factor.indices, factor.data
    columns = turned.indptr, turned.indices, turned.data
    starts, found = np.zeros(count + 1, dtype=np.int32), np.empty(most, dtype=np.int32)
    _find_coupled(*rows[:2], *columns[:2], starts, found)
    found = found[: starts[-1]].copy()
    blocks = np.zeros((len(found), 9))
    entries = np.ascontiguousarray(weights.entries)
    _add_products(*rows, *columns, entries, starts, found, blocks)
    data = blocks.reshape(-1, 3, 3), found, starts
    return sparse.bsr_array(data, shape=(3 * count, 3 * count))


@compiled(f"void({', '.join([_PLACES] * 6)})")
def _find_coupled(
    starts: Ints32,
    columns: Ints32,
    turned_starts: Ints32,
    turned_rows: Ints32,
    found_starts: Ints32,
    found: Ints32,
) -> None:
    """List for each vertex, ascending, those that some row has together with it."""
    count = len(found_starts) - 1
    seen_by = np.full(count, -1, np.int32)
    end = 0
    for vertex in range(count):
        begin = end
        for p in range(turned_starts[vertex], turned_starts[vertex + 1]):
            row = turned_rows[p]
            for q in range(starts[row], starts[row + 1]):
                other = columns[q]
                if seen_by[other] != vertex:
                    seen_by[other] = vertex
                    found[end] = other
                    end += 1
        found[begin:end].sort()
        found_starts[vertex + 1] = end


@compiled(f"void({_SPARSE}, {_SPARSE}, float64[:,::1], {_PLACES}, {_PLACES}, float64[:,::1])")
def _add_products(
    starts: Ints32,
    columns: Ints32,
    entries: Floats,
    turned_starts: Ints32,
    turned_rows: Ints32,
    turned_entries: Floats,
    weights: Floats,
    found_starts: Ints32,
    found: Ints32,
    blocks: Floats,
) -> None:
    count = len(found_starts) - 1
    place = np.empty(count, np.int32)
    for vertex in range(count):
        for at in range(found_starts[vertex], found_starts[vertex + 1]):
            place[found[at]] = at
        for p in range(turned_starts[vertex], turned_starts[vertex + 1]):
            row, share = turned_rows[p], turned_entries[p]
            xx, yy, zz = weights[row, 0], weights[row, 1], weights[row, 2]
            xy, xz, yz = weights[row, 3], weights[row, 4], weights[row, 5]
            for q in range(starts[row], starts[row + 1]):
                at, product = place[columns[q]], share * entries[q]
                blocks[at, 0] += product * xx
                blocks[at, 1] += product * xy
                blocks[at, 2] += product * xz
                blocks[at, 4] += product * yy
                blocks[at, 5] += product * yz
                blocks[at, 8] += product * zz
        for at in range(found_starts[vertex], found_starts[vertex + 1]):
            blocks[at, 3], blocks[at, 6], blocks[at, 7] = (
                blocks[at, 1],
                blocks[at, 2],
                blocks[at, 5],
            )
