"""What a report states of its program and of added faces is held against the rest."""

from __future__ import annotations

from typing import Any

import pytest

from meshcone.detail.records import DetailRecord
from tests.unit.certificate.closeness import FAST, check
from tests.unit.engine.evidence import Evidence
from tests.unit.engine.pairs import rough, smooth


@pytest.mark.parametrize(
    "changes",
    [
        {"formulation": "centroid"},
        {"form": "cvxpy"},
        {"effort": "best"},
        {"solved": False},
        {"confirmed": True, "rounds": []},
        {"iterations": -5},
    ],
)
def test_another_program_than_the_options_ask_for_fails(
    honest: Evidence, changes: dict[str, Any]
) -> None:
    solver = honest.report.solver.model_copy(update=changes)

    forged = honest.with_report(solver=solver)

    assert forged.failed() == {"solver"}
    assert "by the options and rounds, the report states" in check(forged, "solver").words


@pytest.fixture(scope="module")
def undivided() -> Evidence:
    """Four times the faces are allowed, and none are added."""
    detail = {"growth": 4.0, "tolerance": 1.0}
    return Evidence.of(rough(), smooth(), {**FAST, "detail": detail})


def test_added_faces_that_there_are_none_of_are_stated_as_the_source_has_them(
    undivided: Evidence,
) -> None:
    told = undivided.report.detail
    assert told is not None

    assert (told.divided, told.faces_before, told.faces_allowed) == (0, 128, 512)
    assert undivided.failed() == set()


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"swapped": 77}, "states that faces were divided"),
        ({"faces_before": 9, "faces_after": 9}, "the source has 128 faces with area, the report"),
        ({"faces_allowed": 0}, "the options allow 512 faces, the report states 0"),
    ],
)
def test_invented_numbers_of_faces_fail(
    undivided: Evidence, changes: dict[str, Any], said: str
) -> None:
    told = undivided.report.detail
    assert told is not None

    forged = undivided.with_report(detail=told.model_copy(update=changes))

    assert said in check(forged, "division").words


def test_added_faces_that_no_option_allows_fail(honest: Evidence) -> None:
    told = DetailRecord(
        faces_before=128, faces_after=128, faces_allowed=128, divided=0, levels=0, stopped="harm"
    )

    assert not check(honest.with_report(detail=told), "division").ok


def test_a_gate_that_a_tolerance_may_have_been_is_named() -> None:
    gated = Evidence.of(rough(), smooth(), {**FAST, "gates": {"deviation.max": {"max": 0.5}}})

    assert check(gated, "within").words == (
        "there is a gate on 'deviation.max', and the report states no tolerance; whether one was "
        "asked for: not checked"
    )


def test_what_was_not_examined_is_named_as_not_checked(honest: Evidence) -> None:
    assert "what was not examined, and times: not checked" in check(honest, "metrics").words
