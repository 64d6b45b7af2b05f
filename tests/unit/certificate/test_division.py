"""A source whose faces were divided: what is proven of that, and forgeries that fail."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meshcone.certificate.division import DivisionRecord
from meshcone.certificate.file import read_certificate
from meshcone.errors import InputError
from meshcone.files import MeshFile
from meshcone.surface import Subdivision
from meshcone.surface.charts import Charts
from meshcone.verbs.replay import verify_by_replay
from tests.shapes import sphere
from tests.unit.assets.bisecting import bisected
from tests.unit.certificate.dividing import FACES, OPTIONS, REFERENCE, SOURCE, lines
from tests.unit.engine.evidence import Evidence


@pytest.fixture(scope="module")
def honest() -> Evidence:
    return Evidence.of(SOURCE, REFERENCE, OPTIONS)


def test_a_division_is_proven_with_all_that_is_proven_without(honest: Evidence) -> None:
    assert honest.failed() == set()
    found, told = lines(honest), honest.report.detail
    assert told is not None
    children = told.faces_after - told.faces_before + told.divided
    words = f"{children} faces tile {told.divided} of the {told.faces_before} of the source"
    assert found["division"][1].startswith(words)
    assert found["attributes"][1].startswith("COLOR_0, TEXCOORD_0, materials: what lies there")
    assert "byte for byte" in found["written"][1]


def test_it_is_replayed(honest: Evidence) -> None:
    stored = MeshFile("certificate.npz", honest.certificate.to_bytes())
    files = (honest.source, honest.reference, honest.refined)
    assert verify_by_replay(honest.report, stored, *files).ok


def test_it_is_read_as_it_was_stored(honest: Evidence) -> None:
    again = read_certificate(honest.certificate.to_bytes(), "again")
    assert again.arrays_equal(honest.certificate)


@settings(max_examples=30, deadline=None)
@given(st.lists(st.integers(0, 10_000), max_size=12))
def test_any_division_is_read_as_it_was_stored(picks: list[int]) -> None:
    division = bisected(FACES, picks)
    checked = DivisionRecord.of_arrays(DivisionRecord.of(division).arrays()).checked(
        FACES, lambda: Charts.alone(FACES)
    )
    assert np.array_equal(checked.parents, division.parents)
    assert np.array_equal(checked.corners, division.corners)


def test_without_it_the_refined_file_is_of_another_mesh(honest: Evidence) -> None:
    assert lines(honest.with_certificate(division=None))["division"] == (
        False,
        "the report states that faces were divided, the certificate does not",
    )


# Each forges a record whose arrays are its own.
def without_a_child(record: DivisionRecord) -> DivisionRecord:
    return replace(record, parents=record.parents[1:], corners=record.corners[1:])


def one_child_twice(record: DivisionRecord) -> DivisionRecord:
    rows = np.array([0, *range(len(record.parents))])
    return replace(record, parents=record.parents[rows], corners=record.corners[rows])


def one_child_in_the_place_of_another(record: DivisionRecord) -> DivisionRecord:
    record.corners[1] = record.corners[0]
    return record


def a_child_turned_over(record: DivisionRecord) -> DivisionRecord:
    return replace(record, corners=record.corners[:, ::-1])


def a_corner_beyond(record: DivisionRecord) -> DivisionRecord:
    record.corners[0, 0] = (2**record.exponent + 1, 0)
    return record


def a_corner_below_zero(record: DivisionRecord) -> DivisionRecord:
    record.corners[0, 0] = (-1, 1)
    return record


def swapped_parents(record: DivisionRecord) -> DivisionRecord:
    """Two faces with different numbers of children, each with those of the other."""
    parents = record.parents
    counts = np.bincount(parents, minlength=len(FACES))
    first = int(parents[0])
    second = next(face for face in range(len(FACES)) if counts[face] not in (0, counts[first]))
    other = np.where(parents == first, second, np.where(parents == second, first, parents))
    order = np.argsort(other, kind="stable")
    return replace(record, parents=other[order], corners=record.corners[order])


def a_parent_beyond(record: DivisionRecord) -> DivisionRecord:
    record.parents[-1] = len(FACES)
    return record


def a_parent_below(record: DivisionRecord) -> DivisionRecord:
    record.parents[0] = -1
    return record


def huge_numbers(record: DivisionRecord) -> DivisionRecord:
    record.corners[0] += 2**62
    return record


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (without_a_child, "cover less than it"),
        (one_child_twice, "cover more than it"),
        (one_child_in_the_place_of_another, "overlap"),
        (a_child_turned_over, "turned over"),
        (a_corner_beyond, "a child lies outside of face"),
        (a_corner_below_zero, "a child lies outside of face"),
        (swapped_parents, "share a side divide it at different points"),
        (a_parent_beyond, "a face that the source does not have"),
        (a_parent_below, "a face that the source does not have"),
        (huge_numbers, "a child lies outside of face"),
    ],
)
def test_a_record_that_is_no_division_of_the_source_fails(
    honest: Evidence, change: Callable[[DivisionRecord], DivisionRecord], words: str
) -> None:
    record = honest.certificate.division
    assert record is not None
    forged = change(replace(record, parents=+record.parents, corners=+record.corners))
    ok, found = lines(honest.with_certificate(division=forged))["division"]
    assert not ok
    assert words in found


@pytest.mark.parametrize("other", [lambda _: -1, lambda e: e - 1, lambda e: e + 1, lambda _: 2**40])
def test_an_exponent_that_is_not_the_division_s_fails(
    honest: Evidence, other: Callable[[int], int]
) -> None:
    record = honest.certificate.division
    assert record is not None
    forged = replace(record, exponent=other(record.exponent))
    assert "division" in honest.with_certificate(division=forged).failed()


def test_a_report_that_states_other_numbers_of_faces_fails(honest: Evidence) -> None:
    assert honest.report.detail is not None
    other = honest.report.detail.model_copy(update={"divided": 1})
    ok, words = lines(honest.with_report(detail=other))["division"]
    assert (ok, words) == (False, "the report states other numbers of faces than the division has")


def test_the_record_of_another_mesh_fails(honest: Evidence) -> None:
    other = DivisionRecord.of(bisected(sphere(2)[1], [3, 5]))
    ok, words = lines(honest.with_certificate(division=other))["division"]
    assert (ok, words) == (False, "the division is of 128 faces, the source has 32")


def test_another_division_of_the_same_mesh_fails(honest: Evidence) -> None:
    other = DivisionRecord.of(bisected(FACES, range(1, 200, 7)))
    assert "division" in honest.with_certificate(division=other).failed()


@pytest.mark.parametrize(
    ("name", "array"),
    [
        ("parents", np.full(3, np.nan)),
        ("corners", np.full((3, 3, 2), np.nan)),
        ("corners", np.zeros((3, 3, 3), dtype=np.int64)),
        ("shape", np.zeros(3, dtype=np.int64)),
        ("another", np.zeros(3, dtype=np.int64)),
    ],
)
def test_arrays_of_other_types_or_shapes_are_no_record(name: str, array: np.ndarray) -> None:
    arrays = DivisionRecord.of(bisected(FACES, [3, 5])).arrays() | {name: array}
    with pytest.raises(InputError, match="division"):
        DivisionRecord.of_arrays(arrays)


def test_whole_faces_take_no_room() -> None:
    record = DivisionRecord.of(bisected(sphere(4)[1], [5]))
    assert len(record.parents) == 4
    assert DivisionRecord.of(Subdivision.none(9)).parents.size == 0
