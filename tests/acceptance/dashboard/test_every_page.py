"""What holds of all pages: people can use them, whatever they look with."""

from __future__ import annotations

import re

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect

from meshcone.files import MeshFile
from service.api.schemas import Job
from service.client import Client
from service.stack import Stack
from tests import shapes
from tests.acceptance.dashboard.browsing import (
    DESKTOP,
    PHONE,
    difference,
    keep_picture,
    pixels,
    settle,
    warm,
    watched_page,
)


def open_page(page: Page, name: str, job: Job) -> None:
    """Go to one of the pages and wait until it is complete."""
    if name == "jobs":
        page.goto("/")
        page.wait_for_selector("#rows tr[data-id]")
    elif name == "job":
        page.goto(f"/jobs/{job.id}")
        page.wait_for_selector("[data-ready]")
    else:
        page.goto("/docs")
        page.wait_for_selector(".opblock")


@pytest.mark.parametrize(
    ("picture", "scheme", "screen", "height"),
    [("dark", "dark", DESKTOP, 950), ("phone", "light", PHONE, 1400)],
)
def test_a_job_is_shown_in_either_scheme_and_on_a_phone(
    browser: Browser,
    stack: Stack,
    refined: Job,
    picture: str,
    scheme: str,
    screen: dict[str, int],
    height: int,
) -> None:
    with watched_page(browser, stack.url, scheme=scheme, viewport=screen) as (page, faults):
        open_page(page, "job", refined)
        ground = page.evaluate("getComputedStyle(document.body).backgroundColor")
        keep_picture(page, picture, height=height)

    red, green, blue = map(int, re.findall(r"\d+", ground))
    assert (max(red, green, blue) < 64) == (scheme == "dark")
    assert faults.said == []


def tabbed(page: Page, presses: int) -> set[str]:
    """Names, ids, classes and kinds of what is reached by pressing Tab."""
    reached: set[str] = set()
    for _ in range(presses):
        page.keyboard.press("Tab")
        reached |= set(
            page.evaluate(
                "() => { const { name, id, className, dataset } = document.activeElement;"
                " return [name || id, className, dataset.kind ?? '']; }"
            )
        )
    return reached


def test_everything_on_the_jobs_page_is_reached_by_the_keyboard(page: Page, refined: Job) -> None:
    open_page(page, "jobs", refined)
    page.keyboard.press("Tab")
    expect(page.get_by_role("link", name="Skip to content")).to_be_focused()
    assert {"new-job", "name", "order", "theme", "pair", "fail"} <= tabbed(page, 30)

    page.locator("#new-job").press("Enter")
    assert {"close-new", "source", "reference", "swap", "label", "sample"} <= tabbed(page, 9)
    page.keyboard.press("Escape")
    expect(page.get_by_role("dialog")).to_be_hidden()
    expect(page.locator("#new-job")).to_be_focused()


def test_the_api_is_described_without_another_host(page: Page, refined: Job) -> None:
    open_page(page, "docs", refined)

    expect(page.locator("[data-path='/v1/jobs/{job_id}/events']")).to_be_visible()
    page.get_by_text("Submit a mesh and its reference").click()
    expect(page.locator(".opblock.is-open")).to_contain_text("Try it out")


def test_an_unknown_job_is_said_to_be_unknown(browser: Browser, stack: Stack) -> None:
    with watched_page(browser, stack.url) as (page, _):
        page.goto("/jobs/nobody")

        expect(page.get_by_text("There is no such job")).to_be_visible()
        expect(page.get_by_role("link", name="All jobs")).to_be_visible()


def test_what_got_worse_comes_first_and_its_last_two_runs_stand_side_by_side(
    page: Page, client: Client, ball: MeshFile
) -> None:
    vertices, faces = shapes.sphere()
    options = {
        "mode": "measure",
        "quality": {"samples": 500, "emd_samples": 16},
        "gates": {"point_to_surface.max": {"max": 0.04}},
    }
    jobs: dict[str, list[Job]] = {"still.obj": [], "part.obj": []}
    for amount in (0.01, 0.03):
        for name, noise in (("still.obj", 0.02), ("part.obj", amount)):
            source = MeshFile(name, shapes.obj(shapes.noisy(vertices, noise), faces))
            job = client.submit(source, ball, options, labels=["worse"])
            jobs[name].append(client.wait(job.id))
    page.goto("/compare?label=worse")

    expect(page.get_by_test_id("headline")).to_contain_text(
        re.compile("1 of 2 assets got worse.*1 asset stopped passing")
    )
    first = page.locator(".asset").first
    expect(first).to_have_attribute("aria-label", "part.obj → ball.obj")
    expect(first.locator(".dot.bad").first).to_be_visible()
    expect(page.locator(".asset").nth(1).locator(".dot.bad")).to_have_count(0)
    keep_picture(page, "compare", height=900)
    first.get_by_text("8 more values").click()
    expect(first.locator(".trend-chart")).to_have_count(12)

    first.get_by_role("link", name="Last two side by side").click()
    page.wait_for_selector("[data-ready]")
    row = page.get_by_role("row", name=re.compile("^Worst deviation"))
    was, now = (worst_deviation(job) for job in jobs["part.obj"])
    shown = [float(text) for text in row.locator("td.number").all_inner_texts()]
    assert shown == pytest.approx([was, now, now - was], rel=0.01)
    expect(row).to_contain_text(re.compile(r"[\d.]+. worse"))
    keep_picture(page, "two", height=900)

    canvas = page.get_by_test_id("two-view").locator("canvas")
    deviation = pixels(canvas)
    page.get_by_role("button", name="Difference").click()
    settle(page)
    changed = pixels(canvas)
    assert warm(deviation) < 0.01
    assert warm(changed) > 0.1
    canvas.press("ArrowRight")
    settle(page)
    panes = (np.array_split(image, 2, axis=1) for image in (changed, pixels(canvas)))
    assert all(difference(*pair) > 0.5 for pair in zip(*panes, strict=True))


def worst_deviation(job: Job) -> float:
    """In model units, as the job's summary has it."""
    summary = job.summary
    assert summary is not None
    assert summary.radius is not None
    return summary.metrics["point_to_surface.max"] * summary.radius


def test_the_policy_lets_no_script_run_that_is_not_ours(browser: Browser, stack: Stack) -> None:
    with watched_page(browser, stack.url) as (page, faults):
        answer = page.goto("/")
        assert answer is not None
        policy = dict(
            part.strip().split(" ", 1)
            for part in answer.headers["content-security-policy"].split(";")
        )
        ran = page.evaluate(
            "() => { const script = document.createElement('script');"
            " script.textContent = 'window.ran = true'; document.head.append(script);"
            " return window.ran ?? false; }"
        )

        assert policy["default-src"] == "'none'"
        assert "unsafe" not in policy["script-src"] + policy["style-src"]
        assert policy["connect-src"] == "'self'"
        assert ran is False
        assert [said for said in faults.said if "Content Security Policy" in said]
