"""Which edges to split, for a number of faces that may result."""

from __future__ import annotations

import numpy as np

from meshcone.detail.divided_mesh import edge_of_sides
from meshcone.detail.misses import Misses
from meshcone.surface import Mesh
from meshcone.surface.arrays import Bools, Ints

# A side shorter than this share of the longest is not split before it: slivers would be left.
_SHORTEST = 0.6
# The search for the number of faces to split ends within this share of the faces.
_FINENESS = 2000


def choose_edges(
    mesh: Mesh, misses: Misses, divisible: Bools, most_faces: int, counts: Ints
) -> Bools:
    """Choose the edges to split so that at most so many faces result.

    The faces that are to blame for most are split first, each at the side whose middle is
    farthest from the reference for its length. A side that is split adds a face on each side of it.

    Args:
        mesh: the mesh.
        misses: how far it is from the reference.
        divisible: (e,) edges that may be split.
        most_faces: the limit.
        counts: (f,) how many faces of the file's scene each face stands for.

    Returns:
        (e,) which of ``mesh.edges`` to split.
    """
    sides, rows = edge_of_sides(mesh), np.arange(len(mesh.faces))
    lengths = mesh.edge_lengths[sides]
    wanted = (misses.sides * lengths).argmax(axis=1)
    longest = lengths.argmax(axis=1)
    short = lengths[rows, wanted] < _SHORTEST * lengths[rows, longest]
    chosen = sides[rows, np.where(short, longest, wanted)]
    order = np.argsort(-misses.scores, kind="stable")
    order = order[(misses.scores[order] > 0) & divisible[chosen[order]]]

    def marks(count: int) -> Bools:
        marked = np.zeros(len(mesh.edges), dtype=bool)
        marked[chosen[order[:count]]] = True
        return marked

    low, high = 0, len(order) + 1  # so many fit, so many may not
    while high - low > max(1, len(order) // _FINENESS):
        middle = (low + high) // 2
        if counts @ (1 + np.count_nonzero(marks(middle)[sides], axis=1)) <= most_faces:
            low = middle
        else:
            high = middle
    return marks(low)
