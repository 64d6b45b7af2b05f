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

from itertools import combinations

import numpy as np

from meshcone.quality.deviation.games import EDGES
from meshcone.surface.arrays import Bools, Floats, Ints

# Every so many generations the longest edge is cut in the middle.
_MIDDLE_EVERY = 12
# Nearer to the other surface than this share of its longest edge, a piece is cut at prisms only.
_NEAR = 0.1
_LEAST_CREASE, _LEAST_PRISM = 1e-3, 1e-6


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
    sides = corners[:, [1, 2, 0]] - corners
    squared = np.einsum("kij,kij->ki", sides, sides)
    longest = squared.argmax(axis=1)
    turn = near = centre_distances < _NEAR * np.sqrt(squared.max(axis=1))
    edge, at = np.full(len(corners), -1), np.full(len(corners), 0.5)
    if creases:
        edge, at = _crease_cuts(distances)
        turn = near | (depth % 2 == 0) | (edge < 0)
    turn = np.flatnonzero(turn)
    prism_edge, prism_at = _prism_cuts(corners[turn], face[turn])
    found = prism_edge >= 0
    edge[turn[found]], at[turn[found]] = prism_edge[found], prism_at[found]
    middle = (edge < 0) | (depth % _MIDDLE_EVERY == _MIDDLE_EVERY - 1)
    return np.where(middle, longest, edge), np.where(middle, 0.5, at)


def _crease_cuts(distances: Floats) -> tuple[Ints, Floats]:
    """The edge on which the least of the faces' bounds is largest inside; -1 where none is."""
    count = distances.shape[2]
    edge, at = np.full(count, -1), np.full(count, 0.5)
    highest = np.full(count, -np.inf)
    for number, (i, j) in enumerate(EDGES):
        top, where = _envelope_top(distances[i], distances[j])
        higher = (top > highest) & (where > _LEAST_CREASE) & (where < 1 - _LEAST_CREASE)
        edge[higher], at[higher], highest[higher] = number, where[higher], top[higher]
    return edge, at


def _envelope_top(start: Floats, end: Floats) -> tuple[Floats, Floats]:
    """Top of the lower envelope of lines over [0, 1], (f, k) values at either end: value, place."""
    largest = np.maximum(start, end)
    least = largest.argmin(axis=0)[None]
    top = np.take_along_axis(largest, least, 0)[0]
    falling = np.take_along_axis(start, least, 0) >= np.take_along_axis(end, least, 0)
    where = np.where(falling[0], 0.0, 1.0)
    slope = end - start
    for first, second in combinations(range(len(start)), 2):
        with np.errstate(all="ignore"):
            crossing = (start[second] - start[first]) / (slope[first] - slope[second])
            value = start[first] + crossing * slope[first]
        opposed = slope[first] * slope[second] < 0
        lower = opposed & (crossing > 0) & (crossing < 1) & (value < top)
        top, where = np.where(lower, value, top), np.where(lower, crossing, where)
    return top, where


def _prism_cuts(corners: Floats, face: Floats) -> tuple[Ints, Floats]:
    """The edge that leaves the prism over a face farthest, and where; -1 where none does."""
    count = len(corners)
    edge, at, farthest = np.full(count, -1), np.full(count, 0.5), np.zeros(count)
    sides = face[:, [1, 2, 0]] - face
    normal = np.cross(sides[:, 0], sides[:, 2])
    for side in range(3):
        outside = _heights(corners, face[:, side], np.cross(normal, sides[:, side]))
        for number, (i, j) in enumerate(EDGES):
            start, end = outside[:, i], outside[:, j]
            with np.errstate(all="ignore"):
                where = start / (start - end)
            reach = np.maximum(start, end)
            better = _between(where) & (reach > farthest)
            edge[better], at[better], farthest[better] = number, where[better], reach[better]
    return edge, at


def _heights(corners: Floats, origin: Floats, normal: Floats) -> Floats:
    """Heights (k, 3) of corners over planes; NaN over a plane without a normal."""
    with np.errstate(all="ignore"):
        unit = normal / np.sqrt(np.einsum("ki,ki->k", normal, normal))[:, None]
    return np.asarray(np.einsum("kij,kj->ki", corners - origin[:, None], unit))


def _between(where: Floats) -> Bools:
    return np.asarray((where > _LEAST_PRISM) & (where < 1 - _LEAST_PRISM))
