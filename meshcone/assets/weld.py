"""Joins the vertices a file splits at seams.

Files repeat a vertex wherever its normal, texture coordinate or material changes. The
solver must see one vertex there, or the surface tears open along every seam. Two raw
vertices are the same exactly if their positions are equal: a tolerance would also fuse
what an author kept apart.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class WeldedSurface:
    """A triangle surface and the way back to the file's own vertices.

    Attributes:
        positions: (r, 3) raw vertices, in model units.
        triangles: (k, 3) triangles over raw vertices, as the file lists them.
        weld: (r,) welded vertex of each raw vertex; -1 where no triangle uses it.
        vertices: (n, 3) welded vertices, in the order of their first raw vertex.
        faces: (m, 3) triangles over welded vertices; those with a repeated vertex are dropped.
        kept: (m,) the row of ``triangles`` each face came from.
    """

    positions: NDArray[np.float64]
    triangles: NDArray[np.int64]
    weld: NDArray[np.int64]
    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    kept: NDArray[np.int64]


def weld_surface(positions: NDArray[np.float64], triangles: NDArray[np.int64]) -> WeldedSurface:
    """Weld raw vertices at equal positions (-0.0 equals 0.0).

    Args:
        positions: (r, 3) finite positions.
        triangles: (k, 3) indices into ``positions``, in range.
    """
    used = np.zeros(len(positions), dtype=bool)
    used[triangles] = True
    used_vertices = np.flatnonzero(used)
    groups, first_members = group_equal_rows(positions[used_vertices])
    weld = np.full(len(positions), -1, dtype=np.int64)
    weld[used_vertices] = groups

    faces = weld[triangles]
    a, b, c = faces.T
    kept = np.flatnonzero((a != b) & (b != c) & (c != a))
    faces = faces[kept]

    alive = np.zeros(len(first_members), dtype=bool)
    alive[faces] = True
    renumbered = np.where(alive, np.cumsum(alive) - 1, -1)
    weld[used_vertices] = renumbered[groups]
    surface = WeldedSurface(
        positions=positions,
        triangles=triangles,
        weld=weld,
        vertices=positions[used_vertices[first_members[alive]]],
        faces=renumbered[faces],
        kept=kept,
    )
    for array in vars(surface).values():
        array.setflags(write=False)
    return surface


def group_equal_rows(
    rows: NDArray[np.float64],
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Number the distinct rows of a table in the order they first appear.

    Args:
        rows: (k, c) values without NaN; -0.0 and 0.0 are the same value.

    Returns:
        (k,) the group of each row, and (g,) the first row of each group.
    """
    if len(rows) == 0:
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    order = np.lexsort(rows.T)
    ordered = rows[order]
    starts = np.ones(len(rows), dtype=bool)
    starts[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    # lexsort is stable, so the first row of a run is the smallest row number in it.
    first_rows = order[starts]
    appearance = np.argsort(first_rows)
    rank = np.empty_like(appearance)
    rank[appearance] = np.arange(len(appearance))
    groups = np.empty(len(rows), dtype=np.int64)
    groups[order] = rank[np.cumsum(starts) - 1]
    return groups, first_rows[appearance]
