"""Faces of one mesh that pass through each other.

No library without a copyleft licence tests a whole mesh from Python: libigl's test is for one
pair of triangles at a time and calls every pair that touches an overlap, as all neighbours do.

What :func:`_mark_crossing` calls stands above it, because it is compiled when it is read.
"""

from __future__ import annotations

import numpy as np

from meshcone.quality.box_pairs import TooManyPairsError, overlapping_pairs
from meshcone.surface import Mesh
from meshcone.surface.arrays import Bools, Floats, Ints
from meshcone.surface.compiled import compiled

# Nearer than this share of the mesh's extent is touching: a file stores positions in 24 bits.
_TOUCHING = 2e-7
_TINY = 1e-300

_Vector = tuple[float, float, float]

_ROWS, _INDICES = "float64[:,::1]", "int64[:,::1]"


def count_self_intersections(mesh: Mesh, most_pairs: int) -> int | None:
    """Count the pairs of faces that have more in common than a touch.

    Two faces count if the one passes through the other, or if one lies in the other's plane
    and they overlap there. Faces that meet at a common vertex or edge, that only touch, or that
    have the same three vertices do not, and a face without area meets nothing.

    The test is that of Möller, "A fast triangle-triangle intersection test" (1997): each
    triangle has corners on both sides of the other's plane, and the parts of the line common
    to both planes that lie in them overlap.

    Args:
        mesh: the mesh, welded.
        most_pairs: pairs of faces that may be tested; those whose boxes do not overlap are
            none. A tenth of a microsecond each; neighbours alone are six for each face.

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
    if not len(mesh.faces):
        return np.empty((0, 2), dtype=np.int64)
    low, high = mesh.tree.boxes[0, :3], mesh.tree.boxes[0, 3:]
    touching = _TOUCHING * float(np.linalg.norm(high - low))
    found = [np.empty((0, 2), dtype=np.int64)]
    try:
        for pair in overlapping_pairs(mesh.tree, most_pairs, among=mesh.face_areas > 0):
            crossing = _cross(mesh, *pair, touching)
            found.append(np.stack([each[crossing] for each in pair], axis=1))
    except TooManyPairsError:
        return None
    pairs = np.concatenate(found)
    # In an order that shows nothing of the tree.
    return np.asarray(pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))])


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
    try:
        for pair in overlapping_pairs(both.tree, most_pairs):
            apart = (pair[0] < len(mesh.faces)) != (pair[1] < len(mesh.faces))
            first, second = (each[apart] for each in pair)
            if _cross(both, first, second, touching=0.0).any():
                return True
    except TooManyPairsError:
        return True
    return False


def _cross(mesh: Mesh, first: Ints, second: Ints, touching: float) -> Bools:
    """Which pairs of faces have more in common than a touch, (k,)."""
    crossing = np.empty(len(first), dtype=np.bool_)
    pairs = np.stack([first, second], axis=1)
    # What is compiled takes arrays that may be written to, and writes to its last only.
    vertices = np.require(mesh.vertices, requirements="W")
    faces = np.require(mesh.faces, requirements="W")
    _mark_crossing(vertices, faces, mesh.face_normals, pairs, touching, crossing)
    return crossing


@compiled()
def _at(vertices: Floats, vertex: int) -> _Vector:
    return vertices[vertex, 0], vertices[vertex, 1], vertices[vertex, 2]


@compiled()
def _minus(a: _Vector, b: _Vector) -> _Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@compiled()
def _dot(a: _Vector, b: _Vector) -> float:
    return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@compiled()
def _across(a: _Vector, b: _Vector) -> _Vector:
    """Return the unit vector across two others; zero where they are parallel."""
    x = a[1] * b[2] - a[2] * b[1]
    y = a[2] * b[0] - a[0] * b[2]
    z = a[0] * b[1] - a[1] * b[0]
    length = max(np.sqrt(x * x + y * y + z * z), _TINY)
    return x / length, y / length, z / length


@compiled()
def _height(
    vertices: Floats, faces: Ints, normals: Floats, vertex: int, plane: int, touching: float
) -> float:
    """Return a vertex' height over a face's plane; 0 where it touches, or is the face's own."""
    a, b, c = faces[plane, 0], faces[plane, 1], faces[plane, 2]
    if vertex in (a, b, c):
        return 0.0
    height = _dot(_minus(_at(vertices, vertex), _at(vertices, a)), _at(normals, plane))
    return height if abs(height) > touching else 0.0


@compiled()
def _heights(
    vertices: Floats, faces: Ints, normals: Floats, face: int, plane: int, touching: float
) -> _Vector:
    """Return the heights of a face's corners over another's plane."""
    return (
        _height(vertices, faces, normals, faces[face, 0], plane, touching),
        _height(vertices, faces, normals, faces[face, 1], plane, touching),
        _height(vertices, faces, normals, faces[face, 2], plane, touching),
    )


@compiled()
def _is_zero(heights: _Vector) -> bool:
    return bool(heights[0] == 0 and heights[1] == 0 and heights[2] == 0)


@compiled()
def _on_both_sides(heights: _Vector) -> bool:
    return bool(
        min(heights[0], heights[1], heights[2]) < 0 < max(heights[0], heights[1], heights[2])
    )


@compiled()
def _stretch(
    vertices: Floats, faces: Ints, face: int, origin: _Vector, line: _Vector, heights: _Vector
) -> tuple[float, float]:
    """Find where a face meets the line its plane has in common with another's: from, to."""
    low, high = np.inf, -np.inf
    for k in range(3):
        here, there = heights[k], heights[(k + 1) % 3]
        place = _dot(_minus(_at(vertices, faces[face, k]), origin), line)
        if here * there < 0:
            further = _dot(_minus(_at(vertices, faces[face, (k + 1) % 3]), origin), line)
            place += (further - place) * here / (here - there)
        elif here != 0:
            continue
        low, high = min(low, place), max(high, place)
    return low, high


@compiled()
def _pass_through(
    vertices: Floats, faces: Ints, normals: Floats, first: int, second: int, touching: float
) -> bool:
    """Tell whether the parts that both have of the line common to their planes overlap."""
    line = _across(_at(normals, first), _at(normals, second))
    # A common origin near both faces keeps the digits.
    origin = _at(vertices, faces[min(first, second), 0])
    # On the line nothing is near enough to be taken for touching.
    mine = _heights(vertices, faces, normals, first, second, 0.0)
    other = _heights(vertices, faces, normals, second, first, 0.0)
    low, high = _stretch(vertices, faces, first, origin, line, mine)
    other_low, other_high = _stretch(vertices, faces, second, origin, line, other)
    return bool(min(high, other_high) - max(low, other_low) > touching)


@compiled()
def _extent(
    vertices: Floats, faces: Ints, face: int, origin: _Vector, axis: _Vector
) -> tuple[float, float]:
    """Find the least and the greatest place of a face's corners along an axis."""
    a = _dot(_minus(_at(vertices, faces[face, 0]), origin), axis)
    b = _dot(_minus(_at(vertices, faces[face, 1]), origin), axis)
    c = _dot(_minus(_at(vertices, faces[face, 2]), origin), axis)
    return min(a, b, c), max(a, b, c)


@compiled()
def _overlap(
    vertices: Floats, faces: Ints, normals: Floats, first: int, second: int, touching: float
) -> bool:
    """Tell whether faces overlap in the plane of the first: no side of either separates them."""
    shared = 0
    for k in range(3):
        for j in range(3):
            shared += faces[first, k] == faces[second, j]
    if shared == 3:
        return False
    normal, origin = _at(normals, first), _at(vertices, faces[first, 0])
    for face in (first, second):
        for side in range(3):
            start = _at(vertices, faces[face, side])
            axis = _across(normal, _minus(_at(vertices, faces[face, (side + 1) % 3]), start))
            low, high = _extent(vertices, faces, first, origin, axis)
            other_low, other_high = _extent(vertices, faces, second, origin, axis)
            if not min(high, other_high) - max(low, other_low) > touching:
                return False
    return True


@compiled(f"void({_ROWS}, {_INDICES}, {_ROWS}, {_INDICES}, float64, boolean[::1])")
def _mark_crossing(
    vertices: Floats, faces: Ints, normals: Floats, pairs: Ints, touching: float, crossing: Bools
) -> None:
    for place in range(len(pairs)):
        first, second = pairs[place, 0], pairs[place, 1]
        other = _heights(vertices, faces, normals, second, first, touching)
        mine = _heights(vertices, faces, normals, first, second, touching)
        # A small face may lie in the plane of a large one that is far from lying in its plane.
        if _is_zero(other):
            found = _overlap(vertices, faces, normals, first, second, touching)
        elif _is_zero(mine):
            found = _overlap(vertices, faces, normals, second, first, touching)
        else:
            found = _on_both_sides(other) and _on_both_sides(mine)
            if found:
                found = _pass_through(vertices, faces, normals, first, second, touching)
        crossing[place] = found
