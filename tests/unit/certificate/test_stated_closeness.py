"""What a report states of closeness is held against what its files prove."""

from __future__ import annotations

from operator import attrgetter
from typing import Any

import pytest

from tests.unit.certificate.closeness import FAST, check
from tests.unit.engine.evidence import Evidence
from tests.unit.engine.pairs import rough, smooth

NAN = float("nan")

EDITED: dict[str, tuple[dict[str, Any], str]] = {
    "a smaller upper end": ({"upper_model": 0.01, "upper": 0.005, "width": 0.0}, "is proven to be"),
    "a larger lower end": ({"lower_model": 9.0}, "the report states 9"),
    "a point off the surface": ({"at": (9.0, 0.0, 0.0)}, "away from the surface it is on"),
    "another width": ({"width": 0.0}, "the report's width"),
    "other model units": ({"upper_model": 9.0}, "model units"),
    "an upper end that is no number": ({"upper_model": NAN}, "is proven to be"),
    "a lower end that is no number": ({"lower_model": NAN}, "the report states nan"),
    "a point at no place": ({"at": (NAN, NAN, NAN)}, "away from the surface it is on"),
}


@pytest.mark.parametrize("name", EDITED)
@pytest.mark.parametrize("direction", ["extra", "missing"])
def test_an_interval_that_was_edited_fails(honest: Evidence, name: str, direction: str) -> None:
    changes, said = EDITED[name]
    stated = honest.report.deviation
    assert stated is not None
    edited = getattr(stated, direction).model_copy(update=changes)
    deviation = stated.model_copy(update={direction: edited})

    found = check(honest.with_report(deviation=deviation), "deviation")

    assert not found.ok
    assert said in found.words or "'max' is not the larger" in found.words


@pytest.fixture(scope="module")
def gated() -> Evidence:
    """The reference is closed, and a gate asks for the share of area beyond a tolerance."""
    gate = {"deviation.area_beyond": {"max": 0.5, "tolerance": 1e-3}}
    return Evidence.of(rough(), smooth(), {**FAST, "gates": gate})


FLAGS = ("extra", "missing", "max", "outside", "inside", "area_beyond", "area_beyond.missing")


@pytest.mark.parametrize("path", FLAGS)
def test_a_flag_that_was_turned_fails(gated: Evidence, path: str) -> None:
    stated = gated.report.deviation
    flag = attrgetter(path)(stated).proven
    turned = updated(stated, path, {"proven": not flag})

    found = check(gated.with_report(deviation=turned), "deviation")

    assert not found.ok
    assert "proven is not what" in found.words


# What is changed of a part of the section, by its path, and what is said of it.
FORGED: dict[str, tuple[str, dict[str, Any], str]] = {
    "a side that begins too far off": ("inside", {"lower_model": 9.0}, "the report states 9"),
    "a side that is far at no point": ("inside", {"at": None, "lower_model": 9.0}, "no point"),
    "a side in other units": ("outside", {"upper_model": 9.0}, "model units"),
    "a share of nothing": ("area_beyond.extra", {"upper": 0.0, "lower": 0.0}, "goes beyond"),
    "the larger share of nothing": ("area_beyond", {"upper": 0.0}, "not the larger"),
    "a share of more than all": ("area_beyond.extra", {"lower": 2.0, "upper": 2.0}, "not the larg"),
    "another tolerance": ("area_beyond", {"tolerance_model": 9.0}, "not that of its gate"),
    "another width of a share": ("area_beyond", {"width": 0.7}, "its width is not"),
}


@pytest.mark.parametrize("name", FORGED)
def test_a_part_that_was_forged_fails(gated: Evidence, name: str) -> None:
    path, changes, said = FORGED[name]
    stated = gated.report.deviation

    found = check(gated.with_report(deviation=updated(stated, path, changes)), "deviation")

    assert not found.ok
    assert said in found.words


def test_sides_that_are_both_said_to_be_near_fail(gated: Evidence) -> None:
    near = {"lower": 0.0, "upper": 0.0, "width": 0.0, "lower_model": 0.0, "upper_model": 0.0}
    outside = updated(gated.report.deviation, "outside", near)
    both = updated(outside, "inside", near)

    words = check(gated.with_report(deviation=both), "deviation").words

    assert words == "neither 'outside' nor 'inside' reaches as far as 'extra' does"


def updated(record: Any, path: str, changes: dict[str, Any]) -> Any:
    first, _, rest = path.partition(".")
    part = getattr(record, first)
    part = updated(part, rest, changes) if rest else part.model_copy(update=changes)
    return record.model_copy(update={first: part})


def test_what_is_not_checked_is_named(gated: Evidence) -> None:
    assert gated.failed() == set()
    assert check(gated, "deviation").words == (
        "the report's intervals are those found here; which side of the reference a point is on "
        "and the share of area beyond the tolerance, but for whether there is any: not checked"
    )


def test_a_largest_deviation_that_is_neither_direction_s_fails(honest: Evidence) -> None:
    stated = honest.report.deviation
    assert stated is not None
    smallest = min(stated.extra, stated.missing, key=lambda told: told.upper)
    edited = honest.with_report(deviation=stated.model_copy(update={"max": smallest}))

    assert "'max' is not the larger" in check(edited, "deviation").words


def test_a_statement_that_says_more_than_is_proven_fails(honest: Evidence) -> None:
    words = "every point within 0.01 units of the reference (proven)"

    found = check(honest.with_report(statement=words), "deviation")

    assert found.words == "the report's statement is not what its intervals say"


def without_a_proof(evidence: Evidence, **stated: object) -> Evidence:
    """The leaves and the section are taken away from certificate and report."""
    return evidence.with_certificate(closeness=None).with_report(deviation=None, **stated)


def test_a_statement_without_intervals_fails(honest: Evidence) -> None:
    words = "every point within 1e-09 units of the reference (proven)"
    unproven = honest.report.options.deviation.model_copy(update={"prove": False})
    options = honest.report.options.model_copy(update={"deviation": unproven})

    forged = without_a_proof(honest.with_options(options), statement=words)

    found = check(forged, "deviation")
    assert not found.ok
    assert found.words.startswith("the report makes a statement, and has no intervals")


def test_intervals_that_the_options_ask_for_and_nothing_has_fail(honest: Evidence) -> None:
    found = check(without_a_proof(honest, statement=None), "deviation")

    assert not found.ok
    assert found.words.startswith("the options ask for proven intervals")


def test_a_certificate_of_the_first_version_has_no_intervals(honest: Evidence) -> None:
    first = honest.with_document(schema_="meshcone.certificate/1")

    assert without_a_proof(first, statement=None).failed() == set()
