"""Where to cut a piece in two.

Any cut is valid; a good one makes the bounds of the halves exact sooner. Three kinds take turns:

* a *prism cut* is where a plane crosses that stands on an edge of the face closest to the
  centroid. Over the inside of a face the distance is linear, hence its bound exact: two
  tessellations of one surface are told to coincide after finitely many of these;
* a *crease cut* is where the bounds of two faces cross on an edge: there the distance has its
  crease, and on a crease its largest value;
* a cut through the *middle* of the longest edge comes every few generations, so that the
  size of pieces goes to 0 whatever else happens.
"""

from __future__ import annotations

import numpy as np

from meshcone.surface.arrays import Floats, Ints
from meshcone.surface.compiled import compiled

# Every so many generations the longest edge is cut in the middle.
_MIDDLE_EVERY = 12
# Nearer to the other surface than this share of its longest edge, a piece is cut at prisms only.
_NEAR = 0.1
_LEAST_CREASE, _LEAST_PRISM = 1e-3, 1e-6

_Vector = tuple[float, float, float]
_Cut = tuple[int, float]  # an edge, −1 for none, and a share of it


def choose_cuts(
    corners: Floats,
    distances: Floats,
    centre_distances: Floats,
    face: Floats,
    depth: Ints,
    creases: bool,
) -> tuple[Ints, Floats]:
    """Choose for each of k pieces the edge to cut, and where.

    Args:
        corners: (k, 3, 3) of the pieces.
        distances: (3, f, k) of their corners to the faces that bound them.
        centre_distances: (k,) of their centroids.
        face: (k, 3, 3) corners of the face closest to each centroid.
        depth: (k,) cuts above each piece.
        creases: whether the largest distance is looked for.

    Returns:
        (k,) edges, from the corner of that number to the next, and (k,) shares of the edge.
    """
    edges, shares = np.empty(len(corners), dtype=np.int64), np.empty(len(corners))
    _choose_all(
        np.ascontiguousarray(corners),
        np.ascontiguousarray(distances),
        centre_distances,
        np.ascontiguousarray(face),
        depth.astype(np.int64),
        creases,
        edges,
        shares,
    )
    return edges, shares


# What is called stands above what calls it, which is compiled when it is read.


@compiled()
def _envelope_top(distances: Floats, i: int, j: int, piece: int) -> tuple[float, float]:
    """Top of the lower envelope of the faces' lines from corner i to j: value and place."""
    faces = distances.shape[1]
    top, where = np.inf, 0.0
    for face in range(faces):
        start, end = distances[i, face, piece], distances[j, face, piece]
        if max(start, end) < top:
            top, where = max(start, end), 0.0 if start >= end else 1.0
    for first in range(faces):
        for second in range(first + 1, faces):
            here, there = distances[i, first, piece], distances[i, second, piece]
            slope = distances[j, first, piece] - here
            other = distances[j, second, piece] - there
            if slope * other < 0:
                crossing = (there - here) / (slope - other)
                value = here + crossing * slope
                if 0 < crossing < 1 and value < top:
                    top, where = value, crossing
    return top, where


@compiled()
def _crease_cut(distances: Floats, piece: int) -> _Cut:
    """The edge on which the least of the faces' bounds is largest inside."""
    edge, at, highest = -1, 0.5, -np.inf
    for number in range(3):
        top, where = _envelope_top(distances, number, (number + 1) % 3, piece)
        if top > highest and _LEAST_CREASE < where < 1 - _LEAST_CREASE:
            edge, at, highest = number, where, top
    return edge, at


@compiled()
def _side(corners: Floats, start: int) -> _Vector:
    """The vector from a corner of (3, 3) to the next."""
    end = (start + 1) % 3
    x, y = corners[end, 0] - corners[start, 0], corners[end, 1] - corners[start, 1]
    return x, y, corners[end, 2] - corners[start, 2]


@compiled()
def _crossed(u: _Vector, v: _Vector) -> _Vector:
    x, y = u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2]
    return x, y, u[0] * v[1] - u[1] * v[0]


@compiled()
def _product(u: _Vector, v: _Vector) -> float:
    return u[0] * v[0] + u[2] * v[2] + u[1] * v[1]  # numpy's order: the same bits


@compiled()
def _heights(corners: Floats, origin: Floats, normal: _Vector) -> _Vector:
    """Heights of three corners over a plane; no numbers over one without a normal."""
    length = np.sqrt(_product(normal, normal))
    unit = normal[0] / length, normal[1] / length, normal[2] / length
    p, q, r = corners[0], corners[1], corners[2]
    x, y, z = origin[0], origin[1], origin[2]
    a, b = (p[0] - x, p[1] - y, p[2] - z), (q[0] - x, q[1] - y, q[2] - z)
    return _product(a, unit), _product(b, unit), _product((r[0] - x, r[1] - y, r[2] - z), unit)


@compiled()
def _prism_cut(corners: Floats, face: Floats) -> _Cut:
    """The edge of a piece (3, 3) that leaves the prism over a face (3, 3) farthest."""
    edge, at, farthest = -1, 0.5, 0.0
    normal = _crossed(_side(face, 0), _side(face, 2))
    for side in range(3):
        heights = _heights(corners, face[side], _crossed(normal, _side(face, side)))
        for number in range(3):
            start, end = heights[number], heights[(number + 1) % 3]
            where, reach = start / (start - end), max(start, end)
            if _LEAST_PRISM < where < 1 - _LEAST_PRISM and reach > farthest:
                edge, at, farthest = number, where, reach
    return edge, at


@compiled(
    "void(float64[:,:,::1], float64[:,:,::1], float64[::1], float64[:,:,::1], int64[::1],"
    "boolean, int64[::1], float64[::1])"
)
def _choose_all(
    corners: Floats,
    distances: Floats,
    centre_distances: Floats,
    face: Floats,
    depth: Ints,
    creases: bool,
    edges: Ints,
    shares: Floats,
) -> None:
    for piece in range(len(corners)):
        longest, squared = 0, -1.0
        for number in range(3):
            side = _side(corners[piece], number)
            length = _product(side, side)
            if length > squared:
                longest, squared = number, length
        edge, at = -1, 0.5
        if creases:
            edge, at = _crease_cut(distances, piece)
        near = centre_distances[piece] < _NEAR * np.sqrt(squared)
        if near or (creases and (depth[piece] % 2 == 0 or edge < 0)):
            prism_edge, prism_at = _prism_cut(corners[piece], face[piece])
            if prism_edge >= 0:
                edge, at = prism_edge, prism_at
        if edge < 0 or depth[piece] % _MIDDLE_EVERY == _MIDDLE_EVERY - 1:
            edge, at = longest, 0.5
        edges[piece], shares[piece] = edge, at
