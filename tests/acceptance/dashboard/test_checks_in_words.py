"""What a page says of the checks of gates: their units, their counts, and what is a warning."""

from __future__ import annotations

from typing import Any

import pytest
from playwright.sync_api import Page


def check(status: str = "pass", **of: Any) -> dict[str, Any]:
    """A check of the largest distance, as a report has it."""
    return {
        "key": "point_to_surface.max",
        "bound": "max",
        "allowed": 0.1,
        "value": 0.2,
        "limit": 0.1,
        "severity": "error",
        "status": status,
        "words": "worst deviation 0.2, allowed 0.1",
        "position": None,
    } | of


def report(unit: str | None, kind: str, **of: Any) -> dict[str, Any]:
    """A report with one bound of 10 in model units, on a mesh of radius 2."""
    key = "point_to_surface.max"
    return {
        "inputs": {"source": {"format": kind}, "reference": None},
        "frame": {"radius": 2},
        "options": {"gates": {key: {"max_model": 10, "unit": unit}}},
        "gates": {"checks": [check("fail", bound="max_model", allowed=10, limit=10, **of)]},
    }


def said(page: Page, module: str, call: str, value: object) -> Any:
    """What a function of a module of the pages gives for some value."""
    page.goto("/docs")
    return page.evaluate(f"value => import('meshcone/{module}').then(of => of.{call})", value)


@pytest.mark.parametrize(
    ("unit", "kind", "threshold"),
    [("mm", "glb", 0.005), (None, "glb", 5), ("in", "step", 127), ("mm", "obj", 5)],
)
def test_the_threshold_of_the_heat_map_is_in_the_unit_of_the_files(
    page: Page, unit: str | None, kind: str, threshold: float
) -> None:
    found = said(page, "bounds", "distanceThreshold(value)", report(unit, kind))

    assert found == pytest.approx(threshold)


@pytest.mark.parametrize(
    ("unit", "kind", "words"),
    [("mm", "glb", "max_model 10 mm"), (None, "step", "max_model 10 mm")],
)
def test_a_bound_in_model_units_is_written_with_its_unit(
    page: Page, unit: str | None, kind: str, words: str
) -> None:
    call = "boundWords(value, value.gates.checks[0])"

    assert said(page, "bounds", call, report(unit, kind)) == words


def test_a_bound_that_is_a_ratio_is_written_as_it_was_set(page: Page) -> None:
    ratio = {"gates": {"checks": [check(bound="max_ratio_to_floor", allowed=3, limit=0)]}}
    call = "boundWords({inputs: {}}, value.gates.checks[0])"

    assert said(page, "bounds", call, ratio) == "max_ratio_to_floor 3"


WARNING = {"severity": "warning"}


@pytest.mark.parametrize(
    ("verdict", "checks", "sentence"),
    [
        ("pass", [check(), check()], "Passed: 2 checks hold."),
        (
            "pass",
            [check(), check("fail", **WARNING)],
            "Passed, with 1 warning: 1 of 2 checks holds.",
        ),
        (
            "pass",
            [check(), check("not_tested", **WARNING)],
            "Passed, with 1 warning: 1 of 2 checks holds.",
        ),
        ("fail", [check("fail"), check(), check(**WARNING)], "Failed: 1 of 2 checks."),
        (
            "fail",
            [check("fail"), check("fail", **WARNING)],
            "Failed, with 1 warning: 1 of 1 check.",
        ),
    ],
)
def test_the_verdict_counts_warnings_apart(
    page: Page, verdict: str, checks: list[dict[str, Any]], sentence: str
) -> None:
    gates = {"verdict": verdict, "checks": checks}

    assert said(page, "job-words", "verdictSentence(value)", gates) == sentence


def test_the_row_of_a_job_that_passes_names_a_failing_check_a_warning(page: Page) -> None:
    worst = {"key": "emd", "status": "fail", "words": "emd 2, allowed 1"}
    job = {"verdict": "pass", "summary": {"worst": worst}}

    assert said(page, "job-words", "worstWords(value)", job) == "emd 2, allowed 1 (a warning)"


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (0.1001, "just over"),
        (0.2, "2 \N{MULTIPLICATION SIGN} allowed"),
        (200, "over 1000 \N{MULTIPLICATION SIGN} allowed"),
    ],
)
def test_what_is_beyond_its_bound_is_never_said_to_be_once_what_is_allowed(
    page: Page, value: float, words: str
) -> None:
    assert said(page, "verdict-card", "excess(value)", check("fail", value=value)) == words


def test_a_value_that_is_a_record_on_one_side_is_no_row_of_an_audit(page: Page) -> None:
    asset = {
        "source": {"textures": {"count": 0, "images": []}},
        "reference": {"textures": {"count": 1, "images": [{"name": "wood"}]}},
    }

    told = said(page, "audit-cards", "assetCard(value).textContent", asset)

    assert "[object Object]" not in told
