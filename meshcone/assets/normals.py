"""New normals and tangents for vertices that moved.

The rule keeps the author's shading structure and renews its directions:

* Corners at one welded vertex whose stored normals are equal form a *smoothing group*.
  Where an author split the normals (a hard edge), the split stays.
* The new normal of a group is the mean of its triangles' normals in the new geometry,
  each weighted by the triangle's angle at the vertex (Thürmer & Wüthrich 1998), which
  does not depend on how the surface is cut into triangles.
* If the stored normal pointed against that mean in the old geometry, so does the new one.
* A group none of whose triangles moved keeps its stored normal, and so its bytes.
* A tangent is made orthogonal to its new normal again; its handedness stays.
* A normal or tangent that is not finite stays as it is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.weld import group_equal_rows

_SMALLEST = np.finfo(np.float64).tiny


def recompute_normals(
    before: NDArray[np.float64],
    after: NDArray[np.float64],
    faces: NDArray[np.int64],
    corners: NDArray[np.int64],
    weld: NDArray[np.int64],
    stored: NDArray[np.float64],
    selected: NDArray[np.bool_] | None = None,
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Apply the rule above.

    A *shading vertex* is whatever the format gives one normal: a vertex in glTF, a pair of
    position and normal in OBJ.

    Args:
        before: (n, 3) welded vertices as the file has them.
        after: (n, 3) welded vertices to be written.
        faces: (m, 3) triangles over welded vertices.
        corners: (m, 3) shading vertex at each corner of ``faces``; -1 without a normal.
        weld: (s,) welded vertex of each shading vertex, -1 if unused.
        stored: (s, 3) stored normals, in the same space as the vertices.
        selected: (m,) faces whose shading may change, or None for all; a shading vertex that
            another face uses keeps its normal.

    Returns:
        (s, 3) unit normals, meaningful where the second, (s,), says a new one is due.
    """
    if len(weld) == 0:
        return stored.copy(), np.zeros(0, dtype=bool)
    usable = (weld >= 0) & np.isfinite(stored).all(axis=1)
    members = np.flatnonzero(usable)
    numbers, firsts = group_equal_rows(np.column_stack([weld[members], stored[members]]))
    group = np.full(len(weld), -1, dtype=np.int64)
    group[members] = numbers
    corner_group = np.where(corners >= 0, group[corners], -1)

    moved = (before != after).any(axis=1)
    face_moved = moved[faces].any(axis=1)
    touched = np.zeros(len(firsts) + 1, dtype=bool)  # the last slot takes group -1
    touched[corner_group[face_moved]] = True

    old_mean = _group_means(before, faces, corner_group, len(firsts))
    new_mean = _group_means(after, faces, corner_group, len(firsts))
    opposed = (old_mean * stored[members[firsts]]).sum(axis=1) < 0
    new_mean[opposed] *= -1
    length = np.linalg.norm(new_mean, axis=1)
    due = touched[:-1] & (length > _SMALLEST)
    new_mean[due] /= length[due, None]

    if len(firsts) == 0:
        return stored.copy(), np.zeros(len(weld), dtype=bool)
    renewed = (group >= 0) & due[group]
    if selected is not None:
        others = corners[~selected]
        renewed[others[others >= 0]] = False
    return np.where(renewed[:, None], new_mean[group], stored), renewed


def realign_tangents(
    tangents: NDArray[np.float64], normals: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Make (s, 4) tangents orthogonal to (s, 3) unit normals, keeping w.

    A tangent that is parallel to its normal has no direction left and stays as it is; so does one
    that is not finite.

    Returns:
        (s, 4) tangents, and (s,) which of them are new.
    """
    direction = np.where(np.isfinite(tangents).all(axis=1, keepdims=True), tangents, 0.0)[:, :3]
    along = (direction * normals).sum(axis=1, keepdims=True)
    flat = direction - along * normals
    length = np.linalg.norm(flat, axis=1, keepdims=True)
    due = length > 1e-6 * np.linalg.norm(direction, axis=1, keepdims=True)
    unit = flat / np.where(due, length, 1.0)
    aligned = np.column_stack([np.where(due, unit, tangents[:, :3]), tangents[:, 3]])
    return aligned, due[:, 0]


def _group_means(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    corner_group: NDArray[np.int64],
    groups: int,
) -> NDArray[np.float64]:
    """(g, 3) sums of unit face normals weighted by the angle at each corner."""
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    normal = np.cross(b - a, c - a)
    doubled_area = np.linalg.norm(normal, axis=1)
    unit = normal / np.maximum(doubled_area, _SMALLEST)[:, None]
    total = np.zeros((groups, 3))
    for corner, (tip, left, right) in enumerate(((a, b, c), (b, c, a), (c, a, b))):
        angle = np.arctan2(doubled_area, ((left - tip) * (right - tip)).sum(axis=1))
        has_group = corner_group[:, corner] >= 0
        target = corner_group[has_group, corner]
        weighted = (unit * angle[:, None])[has_group]
        for axis in range(3):
            total[:, axis] += np.bincount(target, weighted[:, axis], minlength=groups)
    return total
