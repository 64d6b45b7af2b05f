"""Similarities as 4×4 matrices: x ↦ s R x + t for column vectors."""

from __future__ import annotations

import numpy as np

from meshcone.surface.arrays import Floats, row_lengths


def transform_points(matrix: Floats, points: Floats) -> Floats:
    """Map (k, 3) points by a (4, 4) similarity."""
    return np.asarray(points @ matrix[:3, :3].T + matrix[:3, 3], dtype=np.float64)


def rounding_of(matrix: Floats, points: Floats) -> float:
    """Bound how far :func:`transform_points` puts any of (k, 3) points from its exact image.

    A coordinate is the sum of three products and one number: four roundings of each, at most,
    each by 2⁻⁵³ of the sum of their sizes. Far from the origin that is far more than the result's
    own rounding. The fifth is for the bound itself.
    """
    if np.array_equal(matrix, np.eye(4)):
        return 0.0  # products with 1 and sums with 0 are exact
    sizes = np.abs(points) @ np.abs(matrix[:3, :3]).T + np.abs(matrix[:3, 3])
    return 5 * 2.0**-53 * float(row_lengths(sizes).max(initial=0.0))


def scale_of(matrix: Floats) -> float:
    """Return the factor by which a (4, 4) similarity changes lengths."""
    return float(np.cbrt(abs(np.linalg.det(matrix[:3, :3]))))


def invert(matrix: Floats) -> Floats:
    """Return the (4, 4) inverse of a similarity, without solving a system."""
    inverse = np.eye(4)
    inverse[:3, :3] = matrix[:3, :3].T / scale_of(matrix) ** 2
    inverse[:3, 3] = -inverse[:3, :3] @ matrix[:3, 3]
    return inverse


def similarity(rotation: Floats, scale: float, fixed: Floats, image: Floats) -> Floats:
    """Return the (4, 4) similarity with a given linear part that sends one point to another.

    Args:
        rotation: (3, 3) proper rotation.
        scale: factor on lengths.
        fixed: (3,) the point.
        image: (3,) where it goes.
    """
    matrix = np.eye(4)
    matrix[:3, :3] = scale * rotation
    matrix[:3, 3] = image - matrix[:3, :3] @ fixed
    return matrix


def is_similarity(matrix: Floats, *, rigid: bool) -> bool:
    """Tell whether a (4, 4) matrix is a similarity without reflection; ``rigid``: of scale 1."""
    linear = matrix[:3, :3]
    determinant = float(np.linalg.det(linear))
    if not np.array_equal(matrix[3], [0, 0, 0, 1]) or determinant <= 0:
        return False
    scale = determinant ** (1 / 3)
    orthogonal = np.allclose(linear.T @ linear, scale**2 * np.eye(3), atol=1e-9 * scale**2)
    return bool(orthogonal and (not rigid or abs(scale - 1) < 1e-9))
