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

import numpy as np

from meshcone.quality.deviation.leaves import WEIGHT_PARTS
from meshcone.surface.arrays import Floats, Ints
from meshcone.surface.compiled import compiled

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
    parts = np.empty(distances.shape[1:], dtype=np.int64)
    _weigh_all(np.ascontiguousarray(distances), tried, parts)
    return _largest(mix_distances(distances, parts)), parts


def _largest(distances: Floats) -> Floats:
    """The largest of three corners', (3, …); twice as fast as numpy's own over so short an axis."""
    return np.asarray(np.maximum(np.maximum(distances[0], distances[1]), distances[2]))


def mix_distances(distances: Floats, parts: Ints) -> Floats:
    """Mixed distance of each corner, (3, k), added up in the order of the faces."""
    mixed = np.zeros((3, distances.shape[2]))
    for face in range(distances.shape[1]):
        mixed += parts[face] / WEIGHT_PARTS * distances[:, face]
    return mixed


# What is called stands above what calls it, which is compiled when it is read.


@compiled()
def _farthest(table: Floats, first: int, second: int, third: int, u: float, v: float) -> float:
    """The largest distance of a corner in a mix of three faces, weighed u, v and the rest."""
    largest = 0.0
    for corner in range(3):
        x, y, z = table[corner, first], table[corner, second], table[corner, third]
        largest = max(largest, z + u * (x - z) + v * (y - z))
    return largest


@compiled()
def _hopeless(table: Floats, first: int, second: int, third: int, bound: float) -> bool:
    """Whether no mix of three faces, (3, f), is below a bound: a corner is farther from each."""
    for corner in range(3):
        x, y, z = table[corner, first], table[corner, second], table[corner, third]
        if min(x, min(y, z)) >= bound:
            return True
    return False


@compiled()
def _share_of_two(table: Floats, i: int, first: int, second: int) -> float:
    """The weight of the first of two faces that makes a corner and the next one equally far."""
    j = (i + 1) % 3
    ahead = table[i, first] - table[i, second] - (table[j, first] - table[j, second])
    return float((table[j, second] - table[i, second]) / ahead)


@compiled()
def _shares_of_three(table: Floats, x: int, y: int, z: int) -> tuple[float, float]:
    """The weights of the first two of three faces that make all corners equally far."""
    a1 = table[0, x] - table[0, z] - (table[1, x] - table[1, z])
    b1 = table[0, y] - table[0, z] - (table[1, y] - table[1, z])
    a2 = table[0, x] - table[0, z] - (table[2, x] - table[2, z])
    b2 = table[0, y] - table[0, z] - (table[2, y] - table[2, z])
    c1, c2 = table[1, z] - table[0, z], table[2, z] - table[0, z]
    determinant = a1 * b2 - a2 * b1
    return (c1 * b2 - c2 * b1) / determinant, (a1 * c2 - a2 * c1) / determinant


@compiled()
def _round(weights: Floats, parts: Ints) -> None:
    """Weights in whole parts that add up to one: what is rounded off goes to the largest."""
    largest, left = 0, WEIGHT_PARTS
    for face in range(len(parts)):
        parts[face] = np.int64(np.floor(weights[face] * WEIGHT_PARTS))
        left -= parts[face]
        if parts[face] > parts[largest]:
            largest = face
    parts[largest] += left


@compiled()
def _weigh(table: Floats, weights: Floats, faces: int, tried: int) -> None:
    """Find weights for one piece, (3, f), as :func:`mixed_bound` says."""
    bound, best = np.inf, 0
    for face in range(faces):
        value = max(table[0, face], max(table[1, face], table[2, face]))
        if value < bound:
            best, bound = face, value
    weights[:] = 0.0
    weights[best] = 1.0
    for second in range(tried, faces):
        for first in range(second):
            for i in range(3):
                if _hopeless(table, first, second, second, bound):
                    break
                share = _share_of_two(table, i, first, second)
                if 0 < share < 1:  # false for what is no number
                    value = _farthest(table, first, second, second, share, 0.0)
                    if value < bound:
                        bound = value
                        weights[:] = 0.0
                        weights[first], weights[second] = share, 1 - share
    for third in range(tried, faces):
        for second in range(third):
            for first in range(second):
                if _hopeless(table, first, second, third, bound):
                    continue
                u, v = _shares_of_three(table, first, second, third)
                if u > 0 and v > 0 and u + v < 1:
                    value = _farthest(table, first, second, third, u, v)
                    if value < bound:
                        bound = value
                        weights[:] = 0.0
                        weights[first], weights[second], weights[third] = u, v, 1 - u - v


@compiled("void(float64[:,:,::1], int64, int64[:,::1])")
def _weigh_all(distances: Floats, tried: int, parts: Ints) -> None:
    faces = distances.shape[1]
    table, weights = np.empty((3, faces)), np.empty(faces)
    for piece in range(distances.shape[2]):
        for corner in range(3):
            for face in range(faces):
                table[corner, face] = distances[corner, face, piece]
        _weigh(table, weights, faces, tried)
        _round(weights, parts[:, piece])
