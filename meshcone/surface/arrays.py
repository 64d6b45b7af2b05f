"""Array types and the vector arithmetic every room on top shares."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Bools = NDArray[np.bool_]
Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_TINY = 1e-300


def normalized(vectors: Floats) -> Floats:
    """Scale vectors (..., 3) to unit length; a zero vector stays zero."""
    lengths = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.maximum(lengths, _TINY), dtype=np.float64)


def row_dot(left: Floats, right: Floats) -> Floats:
    """Inner product of corresponding rows, (k, 3) and (k, 3) to (k,)."""
    return np.asarray(np.einsum("ij,ij->i", left, right), dtype=np.float64)
