"""What the page that compares jobs says of how they ended, and of which jobs it says it."""

from __future__ import annotations

import re
from typing import Any

import pytest
from playwright.sync_api import Page, Route, expect

from tests.acceptance.dashboard.browsing import settle

NIGHTS = ("2026-11-29T18:00:00Z", "2026-11-30T18:00:00Z")
FAILED: dict[str, Any] = {"state": "failed", "verdict": None, "summary": None}


def job(name: str, night: str = NIGHTS[0], **of: Any) -> dict[str, Any]:
    """A measurement as the list of jobs has it; it passed its gates unless told otherwise."""
    return {
        "id": f"{name}-{night[:10]}",
        "state": "succeeded",
        "labels": ["night"],
        "created": night,
        "source": {"name": f"{name}.glb"},
        "reference": {"name": "ref.glb"},
        "verdict": "pass",
        "error": None,
        "mode": "measure",
        "links": {},
        "summary": {"radius": 1.0, "metrics": {"hausdorff": 0.1}, "worst": None},
        **of,
    }


def answer(page: Page, jobs: dict[str, list[dict[str, Any]]]) -> None:
    """Answer for the server: the jobs of each label."""

    def listed(route: Route) -> None:
        [label] = re.findall(r"label=(\w+)", route.request.url)
        route.fulfill(json={"jobs": jobs[label], "next": None})

    page.route("**/v1/jobs?*", listed)


@pytest.mark.parametrize(
    ("before", "now", "told"),
    [
        ({}, {"verdict": "not_tested"}, "1 asset stopped passing"),
        ({}, {"verdict": "fail"}, "1 asset stopped passing"),
        ({}, FAILED, "1 asset stopped passing"),
        ({"verdict": "not_tested"}, {"verdict": "fail"}, "1 asset came to a worse end"),
        ({"verdict": "fail"}, FAILED, "1 asset came to a worse end"),
    ],
)
def test_a_worse_end_than_in_the_run_before_is_told(
    page: Page, before: dict[str, Any], now: dict[str, Any], told: str
) -> None:
    answer(page, {"night": [job("a", **before), job("a", NIGHTS[1], **now)]})
    page.goto("/compare?label=night")

    headline = page.get_by_test_id("headline")
    expect(headline).to_contain_text("1 of 1 asset got worse")
    expect(headline).to_contain_text(told)
    expect(headline).to_have_class(re.compile(r"\bfail\b"))


def test_an_asset_that_passes_again_did_not_get_worse(page: Page) -> None:
    answer(page, {"night": [job("a", verdict="not_tested"), job("a", NIGHTS[1])]})
    page.goto("/compare?label=night")

    expect(page.get_by_test_id("headline")).to_contain_text("Nothing got worse")


def test_assets_that_fail_still_are_told_and_nothing_is_green(page: Page) -> None:
    failing = {"verdict": "fail"}
    answer(page, {"night": [job("a", **failing), job("a", NIGHTS[1], **failing)]})
    page.goto("/compare?label=night")

    headline = page.get_by_test_id("headline")
    expect(headline).to_contain_text("Nothing got worse")
    expect(headline).to_contain_text("1 asset fails still")
    expect(headline).not_to_have_class(re.compile(r"\bpass\b"))


def test_a_value_of_samples_makes_no_asset_worse_whose_exact_distance_is_better(
    page: Page,
) -> None:
    before, now = (
        {"summary": {"radius": 1.0, "worst": None, "metrics": metrics}}
        for metrics in (
            {"point_to_surface.max": 0.9, "hausdorff": 0.1},
            {"point_to_surface.max": 0.05, "hausdorff": 0.2},
        )
    )
    answer(page, {"night": [job("a", **before), job("a", NIGHTS[1], **now)]})
    page.goto("/compare?label=night")

    headline = page.get_by_test_id("headline")
    expect(headline).to_contain_text("Nothing got worse")
    expect(headline).to_contain_text("1 asset got better")


@pytest.mark.parametrize(
    "named", [{"chair": "chair", "lamp": "lamp"}, {"chair": None, "lamp": None}]
)
def test_pairs_of_one_batch_are_assets_of_their_own_though_their_files_have_equal_names(
    page: Page, named: dict[str, str | None]
) -> None:
    jobs = [
        job("model", night, id=f"{which}-{night[:10]}", batch=night) | {"name": name}
        for night in NIGHTS
        for which, name in named.items()
    ]
    jobs[-1] |= FAILED
    answer(page, {"night": jobs})
    page.goto("/compare?label=night")

    expect(page.get_by_test_id("headline")).to_contain_text("1 of 2 assets got worse")


@pytest.mark.parametrize(
    ("late", "rest"), [("?label=slow", "**/v1/jobs?label=slow*"), ("", "**/v1/jobs?limit=200")]
)
def test_an_answer_that_comes_late_is_not_shown_under_the_label_chosen_since(
    page: Page, late: str, rest: str
) -> None:
    answer(page, {"slow": [job("slow")], "fast": [job("fast")]})
    held: list[Route] = []
    page.route(rest, lambda route: held.append(route))
    with page.expect_request(rest):
        page.goto(f"/compare{late}")
    page.locator("#choose input").fill("fast")
    page.locator("#choose button").click()
    expect(page.locator("section.asset")).to_contain_text("fast.glb")

    held.pop().fulfill(json={"jobs": [job("slow")], "next": None})
    page.evaluate("fetch('/compare').then(answer => answer.text())")  # by when it has come
    settle(page)
    expect(page.locator("section.asset")).to_contain_text("fast.glb")
    expect(page.locator("#comparison")).not_to_contain_text("slow")


@pytest.mark.parametrize(
    ("ending", "chip", "why"),
    [
        ({"state": "queued"}, "queued", "the one after has not ended yet"),
        ({"state": "running"}, "running", "the one after has not ended yet"),
        ({"state": "canceled"}, "canceled", "the one after was canceled"),
        ({"state": "failed"}, "error", "the one after could not be done"),
        ({"mode": "audit", "reference": None}, "no gates", "the one after was audited by itself"),
    ],
)
def test_of_two_jobs_one_that_has_no_values_is_said_to_be_what_it_is(
    page: Page, ending: dict[str, Any], chip: str, why: str
) -> None:
    without = {"verdict": None, "summary": None}
    jobs = {"a": job("a"), "b": job("b", NIGHTS[1], **without, **ending)}
    page.route("**/v1/jobs/*", lambda route: route.fulfill(json=jobs[route.request.url[-1]]))
    page.goto("/compare?jobs=a,b")

    expect(page.get_by_label("After").locator(".chip")).to_have_text(chip)
    expect(page.get_by_text(f"The two have no value in common: {why}.")).to_be_visible()
