"""Array types and the vector arithmetic every room on top shares."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Bools = NDArray[np.bool_]
Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Ints32 = NDArray[np.int32]

_TINY = 1e-300


def normalized(vectors: Floats) -> Floats:
    """Scale vectors (..., 3) to unit length; a zero vector stays zero."""
    lengths = np.sqrt(np.einsum("...i,...i->...", vectors, vectors))
    return np.asarray(vectors / np.maximum(lengths, _TINY)[..., None], dtype=np.float64)


def row_lengths(vectors: Floats) -> Floats:
    """Euclidean length of each row, (k, d) to (k,); several times as fast as numpy's norm."""
    return np.asarray(np.sqrt(row_dot(vectors, vectors)))


def row_dot(left: Floats, right: Floats) -> Floats:
    """Inner product of corresponding rows, (k, d) and (k, d) to (k,)."""
    return np.asarray(np.einsum("ij,ij->i", left, right), dtype=np.float64)


def differences(points: Floats, pairs: Ints) -> Floats:
    """Return x_i − x_j for (k, 2) pairs (i, j) of rows of (n, 3) points, (k, 3)."""
    result = points.take(pairs[:, 0], axis=0)
    result -= points.take(pairs[:, 1], axis=0)
    return result


def sorted_distinct(keys: Ints) -> Ints:
    """Return the distinct ones of (k,) keys in ascending order, much faster than np.unique."""
    ordered = np.sort(keys)
    return np.asarray(ordered[np.diff(ordered, prepend=ordered[:1] - 1) != 0])
