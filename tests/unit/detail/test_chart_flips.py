"""Diagonals swapped across faces of the source, as far as charts of texture coordinates allow."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.detail.chart_flips import flip_in_charts
from meshcone.detail.divided_mesh import DividedMesh
from meshcone.surface import Mesh, SurfaceTree
from meshcone.surface.charts import Charts

# A square whose diagonal runs from corner 0 to 2; the reference is bent along the other one.
FLAT = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
BENT = FLAT + np.array([[0, 0, 0.3], [0, 0, 0], [0, 0, 0.3], [0, 0, 0]])
FACES = np.array([[0, 1, 2], [0, 2, 3]])
REFERENCE = SurfaceTree(Mesh(BENT, np.array([[0, 1, 3], [1, 2, 3]])))


def corners(charts: Charts, rest: np.ndarray = FLAT) -> set[frozenset[int]]:
    """The corners of both faces afterwards, by the slots that they have."""
    moved = DividedMesh.of(Mesh(rest, FACES)).moved_to(BENT)
    found = flip_in_charts(moved, charts, Mesh(rest, FACES), REFERENCE)
    return {frozenset(FACES.ravel()[each].tolist()) for each in found.slots}


KEPT = {frozenset({0, 1, 2}), frozenset({0, 2, 3})}
SWAPPED = {frozenset({0, 1, 3}), frozenset({1, 2, 3})}


def textured(places: list[list[float]], table: np.ndarray = FACES) -> Charts:
    return Charts(table, np.zeros(2, dtype=np.int64), (np.array(places)[table],))


PLAIN = [[0.0, 0], [1, 0], [1, 1], [0, 1], [5, 5], [6, 6]]


@pytest.mark.parametrize(
    ("charts", "expected"),
    [
        (Charts.alone(FACES), SWAPPED),
        (textured(PLAIN), SWAPPED),
        (textured([[y, x] for x, y in PLAIN]), SWAPPED),
        (textured([[0.6, 0.6], *PLAIN[1:]]), KEPT),
        (textured([[0.5, 0.5], *PLAIN[1:]]), KEPT),
        (textured(PLAIN, np.array([[0, 1, 2], [4, 5, 3]])), KEPT),
        (textured(PLAIN).keeping(np.array([False, True])), KEPT),
        (Charts(FACES, np.array([0, 1])), KEPT),
    ],
    ids=["none", "map", "mirrored", "concave", "flat", "seam", "kept", "two materials"],
)
def test_a_diagonal_is_swapped_where_its_chart_allows_it(
    charts: Charts, expected: set[frozenset[int]]
) -> None:
    assert corners(charts) == expected


def test_a_diagonal_that_folds_the_source_stays() -> None:
    """The corner at which it begins has come from beyond the other diagonal."""
    rest = FLAT.copy()
    rest[0] = (0.7, 0.7, 0)
    assert corners(Charts.alone(FACES), rest) == KEPT
