"""Faces that a mesh stores more than once."""

from __future__ import annotations

import numpy as np

from meshcone.surface.arrays import Ints
from meshcone.surface.mesh import Mesh


def without_copies(mesh: Mesh) -> tuple[Mesh, Ints | None]:
    """Keep one of the faces that have the same three vertices, whichever way they face.

    Modellers store a face twice, once for either side, so that it is seen from both. Such a mesh
    has no side of its own: its normals cancel, and of two equally close faces one looks right
    and the other wrong. The first of them is kept, which exporters write as the front.

    Args:
        mesh: any mesh.

    Returns:
        The mesh without its copies, and which of its faces (k,) were kept, ascending. Where there
        are no copies, or the faces stand for points, the mesh itself and None.
    """
    if mesh.is_points or not _may_have_copies(mesh):
        return mesh, None
    low, middle, high = np.sort(mesh.faces, axis=1).T
    order = np.lexsort((high, middle, low))  # stable: of copies the first comes first
    low, middle, high = low[order], middle[order], high[order]
    fresh = np.ones(len(order), dtype=bool)
    fresh[1:] = (np.diff(low) != 0) | (np.diff(middle) != 0) | (np.diff(high) != 0)
    if fresh.all():
        return mesh, None
    kept = np.sort(order[fresh])
    return Mesh(mesh.vertices, mesh.faces[kept], precision=mesh.precision), kept


def _may_have_copies(mesh: Mesh) -> bool:
    """Tell by sums of random numbers of the corners, which copies have in common."""
    numbers = np.random.default_rng(0).integers(2**63, size=len(mesh.vertices), dtype=np.uint64)
    a, b, c = mesh.faces.T
    sums = np.sort(numbers.take(a) + numbers.take(b) + numbers.take(c))
    return bool((sums[1:] == sums[:-1]).any())
