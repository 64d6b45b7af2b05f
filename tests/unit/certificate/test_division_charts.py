"""Diagonals swapped within charts of texture coordinates: what is proven, and what is refused."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from meshcone.certificate.division import DivisionRecord
from meshcone.errors import InputError
from meshcone.files import MeshFile
from meshcone.surface import Subdivision
from meshcone.surface.charts import Charts
from tests.unit.certificate.dividing import FEW, lines
from tests.unit.engine.evidence import Evidence


def ridge(cells: int, height: float) -> bytes:
    """A square with a ridge across the diagonals of its cells, in two materials."""
    x, y = np.meshgrid(*[np.linspace(0, 1, cells + 1)] * 2)
    z = height * np.exp(-60 * (x + y - 1) ** 2)
    rows = list(zip(x.ravel(), y.ravel(), z.ravel(), strict=True))
    text = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in rows]
    text += [f"vt {x:.6f} {y:.6f}" for x, y, _ in rows]
    for row in range(cells):
        text += ["usemtl other"] if row == cells // 2 else []
        for a in range(row * (cells + 1) + 1, row * (cells + 1) + cells + 1):
            b, c, d = a + 1, a + cells + 2, a + cells + 1
            text += [f"f {a}/{a} {b}/{b} {c}/{c}", f"f {a}/{a} {c}/{c} {d}/{d}"]
    return "\n".join([*text, ""]).encode()


@pytest.fixture(scope="module")
def honest() -> Evidence:
    source, reference = MeshFile("flat.obj", ridge(6, 0.0)), MeshFile("ridge.obj", ridge(24, 0.2))
    detail = {"growth": 2, "flips": "chart"}
    options = {"effort": "fast", "quality": FEW, "detail": detail}
    return Evidence.of(source, reference, options)


def test_swapped_diagonals_are_proven_with_all_that_is_proven_without(honest: Evidence) -> None:
    told = honest.report.detail
    assert told is not None
    assert told.swapped > 0
    assert all(ok for ok, _ in lines(honest).values())
    assert f"{told.swapped} of these took corners from each other" in lines(honest)["division"][1]


def test_the_report_says_that_the_texture_s_map_is_another_inside(honest: Evidence) -> None:
    codes = {warning.code for warning in honest.report.warnings}
    assert "writing.diagonals" in codes


def test_diagonals_that_no_option_asks_to_swap_fail(honest: Evidence) -> None:
    options = honest.report.options
    parent = options.model_copy(
        update={"detail": options.detail.model_copy(update={"flips": "parent"})}
    )
    ok, words = lines(honest.with_report(options=parent))["division"]
    assert (ok, words) == (
        False,
        "diagonals are swapped on sides of faces, and no option asks for it",
    )


# A square of two faces, and a third one beyond a seam of its texture.
FACES = np.array([[0, 1, 2], [0, 2, 3], [3, 2, 4]])
VERTICES = np.array([[0, 1, 2], [0, 2, 3], [5, 6, 4]])
PLACES = np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 3], [0, 2], [1, 2]], dtype=float)
SWAPPED = np.array([[0, 1, 5], [1, 2, 5], [6, 7, 8]])


def square(places: np.ndarray = PLACES, labels: tuple[int, ...] = (0, 0, 0)) -> Charts:
    return Charts(VERTICES, np.array(labels), (places[VERTICES],))


def swapped(slots: np.ndarray = SWAPPED) -> DivisionRecord:
    return DivisionRecord.of(replace(Subdivision.none(3), slots=slots))


def test_a_diagonal_within_a_chart_may_be_swapped() -> None:
    record = DivisionRecord.of_arrays(swapped().arrays())
    found = record.checked(FACES, square)
    assert np.array_equal(found.over(FACES, 5).faces, [[0, 1, 3], [1, 2, 3], [3, 2, 4]])


@pytest.mark.parametrize(
    ("charts", "words"),
    [
        (lambda: square(labels=(0, 1, 0)), "of another chart or material"),
        (lambda: square(labels=(-1, -1, 0)), "a face that stays"),
        # The corner at the diagonal's end lies inside the triangle of the other three.
        (
            lambda: square(np.concatenate([[[0.6, 0.4]], PLACES[1:]])),
            "turned over, or without area",
        ),
    ],
    ids=["two materials", "kept", "concave"],
)
def test_a_diagonal_that_its_chart_does_not_let_be_swapped_is_refused(
    charts: Callable[[], Charts], words: str
) -> None:
    with pytest.raises(InputError, match=words):
        swapped().checked(FACES, charts)


@pytest.mark.parametrize(
    ("slots", "words"),
    [
        ([[0, 1, 5], [3, 4, 5], [6, 7, 8]], "the border of a chart is another one"),
        ([[0, 1, 5], [0, 1, 2], [6, 7, 8]], "the border of a chart is another one"),
        ([[0, 1, 5], [1, 2, 2], [6, 7, 8]], "turned over, or without area"),
        ([[0, 1, 2], [3, 4, 5], [6, 4, 8]], "a vertex is in no face any more"),
        ([[0, 1, 9], [1, 2, 5], [6, 7, 8]], "between faces that there are none of"),
    ],
    ids=["overlapping", "twice covered", "no area", "over a seam", "out of range"],
)
def test_faces_that_do_not_cover_their_chart_once_are_refused(
    slots: list[list[int]], words: str
) -> None:
    with pytest.raises(InputError, match=words):
        swapped(np.array(slots)).checked(FACES, square)


def test_without_texture_coordinates_the_border_is_kept_all_the_same() -> None:
    found = swapped().checked(FACES, lambda: Charts.alone(FACES))
    assert found.swapped.tolist() == [True, True, False]
    with pytest.raises(InputError, match="the border of a chart"):
        swapped(np.array([[0, 1, 5], [3, 2, 8], [6, 7, 8]])).checked(
            FACES, lambda: Charts.alone(FACES)
        )
