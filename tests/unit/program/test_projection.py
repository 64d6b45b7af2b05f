"""The projection onto the dual cone, and its derivative."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from meshcone.program.cones import ConeType
from meshcone.program.projection import project_dual, projection_derivative


@dataclass(frozen=True)
class Kind:
    cone: ConeType
    dimension: int


@dataclass(frozen=True)
class Rows:
    family: Kind
    size: int


EQUAL = Rows(Kind("zero", 3), 3)
POSITIVE = Rows(Kind("linear", 1), 4)
LENGTH = Rows(Kind("second_order", 4), 4)
# Its tip is above the length of the rest, between both signs of it, or below.
INSIDE, BETWEEN, OPPOSITE = [3.0, 1, -2, 0.5], [0.4, 1, -2, 0.5], [-3.0, 1, -2, 0.5]


def test_a_vector_is_projected_cone_by_cone() -> None:
    given = [-1.0, 2, -3, *[-1.0, 2, 0, -3], *BETWEEN]

    found = project_dual(np.array(given), [EQUAL, POSITIVE, LENGTH])

    np.testing.assert_array_equal(found[:7], [-1, 2, -3, 0, 2, 0, 0])
    length = np.linalg.norm(BETWEEN[1:])
    half = (BETWEEN[0] + length) / 2
    np.testing.assert_allclose(found[7:], [half, *(half * np.array(BETWEEN[1:]) / length)])


def test_what_is_in_a_cone_stays_and_what_is_opposite_becomes_zero() -> None:
    found = project_dual(np.array([*INSIDE, *OPPOSITE]), [LENGTH, LENGTH])

    np.testing.assert_array_equal(found, [*INSIDE, 0, 0, 0, 0])


@pytest.mark.parametrize("tip", [INSIDE, BETWEEN, OPPOSITE], ids=["inside", "between", "opposite"])
def test_the_derivative_is_the_slope_of_the_projection(tip: list[float]) -> None:
    at, blocks = np.array([0.3, -0.2, 1, *[-1.0, 2, 0.5, -3], *tip]), [EQUAL, POSITIVE, LENGTH]
    step = 1e-6 * np.eye(len(at))

    slopes = np.array(
        [(project_dual(at + s, blocks) - project_dual(at - s, blocks)) / 2e-6 for s in step]
    ).T

    found = projection_derivative(at, blocks).toarray()
    np.testing.assert_allclose(found, slopes, atol=1e-8)


def test_without_rows_there_is_nothing_to_project() -> None:
    assert project_dual(np.zeros(0), []).shape == (0,)
