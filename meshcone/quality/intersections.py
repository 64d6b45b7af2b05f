"""Faces of one mesh that pass through each other.

No library without a copyleft licence tests a whole mesh from Python: libigl's test is for one
pair of triangles at a time and calls every pair that touches an overlap, as all neighbours do.
"""

from __future__ import annotations

import numpy as np

from meshcone.quality.box_pairs import TooManyPairsError, overlapping_pairs
from meshcone.surface import Mesh
from meshcone.surface.arrays import Bools, Floats, Ints, normalized, row_dot

# Nearer than this share of the mesh's extent is touching: a file stores positions in 24 bits.
_TOUCHING = 2e-7


def count_self_intersections(mesh: Mesh, most_pairs: int) -> int | None:
    """Count the pairs of faces that have more in common than a touch.

    Two faces count if the one passes through the other, or if they lie in one plane and
    overlap there. Faces that meet at a common vertex or edge, that only touch, or that have
    the same three vertices do not, and a face without area meets nothing.

    The test is that of Möller, "A fast triangle-triangle intersection test" (1997): each
    triangle has corners on both sides of the other's plane, and the parts of the line common
    to both planes that lie in them overlap.

    Args:
        mesh: the mesh, welded.
        most_pairs: pairs of faces that may be tested; those whose boxes do not overlap are
            none. About a microsecond each; neighbours alone are six for each face.

    Returns:
        The count, or None where a position is not finite or the search would take too long.
    """
    found = self_intersections(mesh, most_pairs)
    return None if found is None else len(found)


def self_intersections(mesh: Mesh, most_pairs: int) -> Ints | None:
    """Find the pairs of faces that :func:`count_self_intersections` counts, (k, 2)."""
    if most_pairs not in mesh.crossings:
        mesh.crossings[most_pairs] = _crossings(mesh, most_pairs)
    return mesh.crossings[most_pairs]


def _crossings(mesh: Mesh, most_pairs: int) -> Ints | None:
    if not np.isfinite(mesh.vertices[mesh.used_vertices]).all():
        return None
    corners = mesh.corners
    low, high = corners.min(axis=1), corners.max(axis=1)
    solid = np.flatnonzero(mesh.face_areas > 0)
    found = [np.empty((0, 2), dtype=np.int64)]
    if not len(solid):
        return found[0]
    touching = _TOUCHING * float(np.linalg.norm(high.max(axis=0) - low.min(axis=0)))
    try:
        for first, second in overlapping_pairs(low[solid], high[solid], most_pairs):
            crossing = _cross(mesh, solid[first], solid[second], touching)
            found.append(np.stack([solid[first[crossing]], solid[second[crossing]]], axis=1))
    except TooManyPairsError:
        return None
    return np.concatenate(found)


def pass_through_each_other(mesh: Mesh, other: Mesh, most_pairs: int) -> bool:
    """Whether a face of one mesh passes through a face of another, or lies in its plane on it.

    Args:
        mesh: the one.
        other: the other, in the same unit.
        most_pairs: pairs of faces that may be tested; see :func:`count_self_intersections`.

    Returns:
        True also where a position is not finite or the search would take too long, and it may be
        where they only touch: what is told to be apart is, but for the last digits.
    """
    both = Mesh(
        np.concatenate([mesh.vertices, other.vertices]),
        np.concatenate([mesh.faces, other.faces + len(mesh.vertices)]),
    )
    if not np.isfinite(both.vertices[both.used_vertices]).all():
        return True
    low, high = both.corners.min(axis=1), both.corners.max(axis=1)
    try:
        for pair in overlapping_pairs(low, high, most_pairs):
            apart = (pair[0] < len(mesh.faces)) != (pair[1] < len(mesh.faces))
            first, second = (each[apart] for each in pair)
            if _cross(both, first, second, touching=0.0).any():
                return True
    except TooManyPairsError:
        return True
    return False


def _cross(mesh: Mesh, first: Ints, second: Ints, touching: float) -> Bools:
    """Which pairs of faces have more in common than a touch, (k,)."""
    there = _heights(mesh, second, first, touching)
    in_plane, across = ~there.any(axis=0), _on_both_sides(there)
    across[across] = _on_both_sides(_heights(mesh, first[across], second[across], touching))
    crossing = np.zeros(len(first), dtype=bool)
    crossing[in_plane] = _overlap(mesh, first[in_plane], second[in_plane], touching)
    crossing[across] = _pass_through(mesh, first[across], second[across], touching)
    return crossing


def _corners(mesh: Mesh, faces: Ints) -> list[Floats]:
    """The three corners of faces, each (k, 3)."""
    return [mesh.vertices.take(corner, axis=0) for corner in mesh.faces.take(faces, axis=0).T]


def _heights(mesh: Mesh, faces: Ints, planes: Ints, touching: float) -> Floats:
    """Heights (3, k) of corners over other faces' planes; 0 where they touch or are shared."""
    normals = mesh.face_normals.take(planes, axis=0)
    origin = mesh.vertices.take(mesh.faces[:, 0].take(planes), axis=0)
    heights = np.stack([row_dot(corner - origin, normals) for corner in _corners(mesh, faces)])
    heights[np.abs(heights) <= touching] = 0
    heights[_shared(mesh, faces, planes)] = 0
    return heights


def _shared(mesh: Mesh, faces: Ints, others: Ints) -> Bools:
    """Which corners (3, k) are corners of the other faces too."""
    mine = np.ascontiguousarray(mesh.faces.take(faces, axis=0).T)
    a, b, c = np.ascontiguousarray(mesh.faces.take(others, axis=0).T)
    return np.asarray((mine == a) | (mine == b) | (mine == c))


def _on_both_sides(heights: Floats) -> Bools:
    return np.asarray((heights.min(axis=0) < 0) & (heights.max(axis=0) > 0))


def _pass_through(mesh: Mesh, first: Ints, second: Ints, touching: float) -> Bools:
    line = normalized(np.cross(mesh.face_normals[first], mesh.face_normals[second]))
    low, high = _stretch(mesh, first, second, line)
    other_low, other_high = _stretch(mesh, second, first, line)
    return np.asarray(np.minimum(high, other_high) - np.maximum(low, other_low) > touching)


def _stretch(mesh: Mesh, faces: Ints, planes: Ints, line: Floats) -> tuple[Floats, Floats]:
    """Where each face meets the line its plane has in common with another's: from, to."""
    heights = _heights(mesh, faces, planes, 0.0)
    # A common origin near both faces keeps the digits.
    origin = mesh.vertices[mesh.faces[np.minimum(faces, planes), 0]]
    places = np.stack([row_dot(corner - origin, line) for corner in _corners(mesh, faces)])
    next_heights, next_places = np.roll(heights, -1, axis=0), np.roll(places, -1, axis=0)
    cut = heights * next_heights < 0
    drop = np.where(cut, heights - next_heights, 1.0)
    cuts = places + (next_places - places) * heights / drop
    low = np.where(cut, cuts, np.where(heights == 0, places, np.inf)).min(axis=0)
    high = np.where(cut, cuts, np.where(heights == 0, places, -np.inf)).max(axis=0)
    return low, high


def _overlap(mesh: Mesh, first: Ints, second: Ints, touching: float) -> Bools:
    """Whether faces in one plane overlap there: no side of either separates them."""
    normals = mesh.face_normals[first]
    origin = mesh.vertices[mesh.faces[first, 0]]
    mine, other = (
        [corner - origin for corner in _corners(mesh, faces)] for faces in (first, second)
    )
    overlapping = ~_shared(mesh, first, second).all(axis=0)
    for corners in (mine, other):
        for side in range(3):
            axis = normalized(np.cross(normals, corners[(side + 1) % 3] - corners[side]))
            a, b = (np.stack([row_dot(c, axis) for c in triangle]) for triangle in (mine, other))
            depth = np.minimum(a.max(axis=0), b.max(axis=0)) - np.maximum(
                a.min(axis=0), b.min(axis=0)
            )
            overlapping &= depth > touching
    return np.asarray(overlapping)
