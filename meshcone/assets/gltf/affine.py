"""Affine maps applied to rows.

Written out instead of as matrix products: a product's rounding may depend on a row's
place in the array, and equal vertices must stay equal to be welded.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def transform_points(
    matrix: NDArray[np.float64], points: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(k, 3) points under a (4, 4) affine matrix."""
    return transform_vectors(matrix, points) + matrix[:3, 3]


def transform_vectors(
    matrix: NDArray[np.float64], vectors: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(k, 3) vectors under the linear part of a matrix."""
    x, y, z = vectors[:, 0:1], vectors[:, 1:2], vectors[:, 2:3]
    return x * matrix[:3, 0] + y * matrix[:3, 1] + z * matrix[:3, 2]


def restore_points(matrix: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """(k, 3) points that a regular (4, 4) affine matrix maps to the given ones."""
    inverse = np.linalg.inv(matrix[:3, :3]).astype(np.float64)
    return transform_vectors(inverse, points - matrix[:3, 3])


def is_singular(matrix: NDArray[np.float64]) -> bool:
    """Whether a (4, 4) affine matrix loses a dimension, to working precision."""
    return rank(matrix) < 3


def rank(matrix: NDArray[np.float64]) -> int:
    """How many dimensions a (4, 4) affine matrix keeps, to working precision."""
    singular_values = np.linalg.svd(matrix[:3, :3], compute_uv=False)
    return int(np.count_nonzero(singular_values > 1e-12 * singular_values[0]))
