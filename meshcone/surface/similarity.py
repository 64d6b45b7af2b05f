"""Similarities as 4×4 matrices: x ↦ s R x + t for column vectors."""

from __future__ import annotations

import numpy as np

from meshcone.surface.arrays import Floats


def transform_points(matrix: Floats, points: Floats) -> Floats:
    """Map (k, 3) points by a (4, 4) similarity."""
    return np.asarray(points @ matrix[:3, :3].T + matrix[:3, 3], dtype=np.float64)


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
