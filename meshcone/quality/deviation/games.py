"""Bounding a piece of a surface by several faces of the other at once.

A piece has three corners, and D[i, k] is the distance of corner i to face k. Faces mixed by
weights μ_k ≥ 0 that add up to 1 bound the piece by max_i Σ_k μ_k D[i, k]
(:class:`~meshcone.quality.deviation.leaves.Leaves` says why). The least such bound is the
value of a matrix game. Any weights give a valid bound, so the ones found here need not be best,
and nothing about how they were found needs to be right.

Where the distances to the faces are linear on the piece, which they are over the inside of a
face, and along creases between such places, the best weights give the exact maximum.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

import numpy as np

from meshcone.quality.deviation.leaves import WEIGHT_PARTS
from meshcone.surface.arrays import Floats, Ints

EDGES = ((0, 1), (1, 2), (2, 0))


def single_face_bound(distances: Floats) -> tuple[Floats, Ints]:
    """The least bound by one face, and that face's place, for (3, f, k) distances; (k,) each."""
    largest = _largest(distances)
    face = largest.argmin(axis=0)
    return largest[face, np.arange(len(face))], face


def mixed_bound(distances: Floats, tried: int = 0) -> tuple[Floats, Ints]:
    """A bound by several faces.

    Tries the weights that make two corners equally far in a mix of two faces, and those that
    make all three equally far in a mix of three.

    Args:
        distances: (3, f, k) of three corners to f faces, for k pieces.
        tried: mixes of the first so many faces alone are left out: they are known.

    Returns:
        (k,) bounds, never above those of a single face, and (f, k) weights in parts of 2⁻²⁴.
    """
    bound, face = single_face_bound(distances)
    rows = np.arange(len(bound))
    weights = np.zeros(distances.shape[1:])
    weights[face, rows] = 1
    for faces, shares, values in (*_of_two(distances, tried), *_of_three(distances, tried)):
        best = values.argmin(axis=0)
        better = np.flatnonzero(values[best, rows] < bound)
        best = best[better]
        bound[better] = values[best, better]
        weights[:, better] = 0
        for place, share in zip(faces, shares, strict=True):
            weights[place[best], better] = share[best, better]
    parts = _whole_parts(weights)
    return _largest(mix_distances(distances, parts)), parts


# Mixes that were tried: of which faces (c,) each, in which shares (c, k), and their bounds (c, k).
_Mixes = tuple[tuple[Ints, ...], tuple[Floats, ...], Floats]


def _largest(distances: Floats) -> Floats:
    """The largest of three corners', (3, …); twice as fast as numpy's own over so short an axis."""
    return np.asarray(np.maximum(np.maximum(distances[0], distances[1]), distances[2]))


def _of_two(distances: Floats, tried: int) -> Iterator[_Mixes]:
    """Mixes of two faces that make the two ends of an edge equally far."""
    first, second = _choices(distances.shape[1], 2, tried)
    x, y = distances[:, first], distances[:, second]
    ahead = x - y
    for i, j in EDGES:
        with np.errstate(all="ignore"):
            share = (y[j] - y[i]) / (ahead[i] - ahead[j])
        inside = (share > 0) & (share < 1)  # false for NaN
        share = np.where(inside, share, 0.0)
        values = _largest(y + share * ahead)
        yield (first, second), (share, 1 - share), np.where(inside, values, np.inf)


def _of_three(distances: Floats, tried: int) -> Iterator[_Mixes]:
    """Mixes of three faces that make all three corners equally far."""
    if distances.shape[1] < 3:
        return
    faces = _choices(distances.shape[1], 3, tried)
    x, y, z = (distances[:, each] for each in faces)
    x_ahead, y_ahead = x - z, y - z
    a1, b1, c1 = x_ahead[0] - x_ahead[1], y_ahead[0] - y_ahead[1], z[1] - z[0]
    a2, b2, c2 = x_ahead[0] - x_ahead[2], y_ahead[0] - y_ahead[2], z[2] - z[0]
    with np.errstate(all="ignore"):
        determinant = a1 * b2 - a2 * b1
        first, second = (c1 * b2 - c2 * b1) / determinant, (a1 * c2 - a2 * c1) / determinant
        inside = (first > 0) & (second > 0) & (first + second < 1)
    first, second = np.where(inside, first, 0.0), np.where(inside, second, 0.0)
    values = _largest(z + first * x_ahead + second * y_ahead)
    yield faces, (first, second, 1 - first - second), np.where(inside, values, np.inf)


def _choices(faces: int, count: int, tried: int) -> tuple[Ints, ...]:
    chosen = [each for each in combinations(range(faces), count) if each[-1] >= tried]
    return tuple(np.array(chosen).T)


def mix_distances(distances: Floats, parts: Ints) -> Floats:
    """Mixed distance of each corner, (3, k), added up in the order of the faces."""
    mixed = np.zeros((3, distances.shape[2]))
    for face in range(distances.shape[1]):
        mixed += parts[face] / WEIGHT_PARTS * distances[:, face]
    return mixed


def _whole_parts(weights: Floats) -> Ints:
    """Weights in whole parts that add up to one: what is rounded off goes to the largest."""
    parts = np.floor(weights * WEIGHT_PARTS).astype(np.int64)
    largest = parts.argmax(axis=0)
    parts[largest, np.arange(parts.shape[1])] += WEIGHT_PARTS - parts.sum(axis=0)
    return parts
