"""Motions of points, and what they round."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from meshcone.surface.arrays import Floats
from meshcone.surface.similarity import rounding_of, similarity, transform_points

FAR = np.array([500000.3, 4600000.7, 100.1])


def exactly(matrix: Floats, point: Floats) -> list[Fraction]:
    rows = [[Fraction(float(entry)) for entry in row] for row in matrix[:3]]
    place = [*(Fraction(float(value)) for value in point), Fraction(1)]
    return [sum((a * b for a, b in zip(row, place, strict=True)), Fraction(0)) for row in rows]


def test_what_a_motion_from_far_away_rounds_is_within_its_bound() -> None:
    rng = np.random.default_rng(0)
    worst = 0.0
    for _ in range(50):
        rotation = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        matrix = similarity(rotation, rng.uniform(0.1, 10), FAR, np.zeros(3))
        points = FAR + rng.normal(size=(20, 3))

        bound = rounding_of(matrix, points)

        for point, image in zip(points, transform_points(matrix, points), strict=True):
            apart = zip(exactly(matrix, point), image, strict=True)
            square = sum((a - Fraction(float(b))) ** 2 for a, b in apart)
            assert square <= Fraction(bound) ** 2
            worst = max(worst, float(square) ** 0.5 / bound)
    assert worst > 0.05  # the bound is no larger than it has to be by much


def test_what_is_not_moved_is_not_rounded() -> None:
    assert rounding_of(np.eye(4), FAR[None]) == 0.0
