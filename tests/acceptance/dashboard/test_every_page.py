"""What holds of all pages: people can use them, whatever they look with."""

from __future__ import annotations

from typing import Any

import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, Page, expect

from meshcone.files import MeshFile
from service.api.schemas import Job
from service.client import Client
from service.stack import Stack
from tests import shapes
from tests.acceptance.dashboard.browsing import PHONE, keep_picture, watched_page

SERIOUS = {"serious", "critical"}


def open_page(page: Page, name: str, job: Job) -> None:
    """Go to one of the pages and wait until it is complete."""
    if name == "jobs":
        page.goto("/")
        page.wait_for_selector("#rows tr[data-id]")
    elif name == "job":
        page.goto(f"/jobs/{job.id}")
        page.wait_for_selector("[data-ready]")
    elif name == "compare":
        page.goto("/compare?label=jugs")
        page.wait_for_selector(".charts")
    else:
        page.goto("/docs")
        page.wait_for_selector(".opblock")


def serious_violations(page: Page) -> list[dict[str, Any]]:
    found = Axe().run(page).response["violations"]
    return [
        {"rule": each["id"], "at": [node["html"][:200] for node in each["nodes"]]}
        for each in found
        if each["impact"] in SERIOUS
    ]


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("name", ["jobs", "job", "compare"])
def test_no_serious_barrier_in_either_scheme(
    browser: Browser, stack: Stack, refined: Job, name: str, scheme: str
) -> None:
    with watched_page(browser, stack.url, scheme=scheme) as (page, _):
        open_page(page, name, refined)
        if (name, scheme) == ("job", "dark"):
            keep_picture(page, "dark", height=950)

        assert serious_violations(page) == []


@pytest.mark.parametrize("name", ["jobs", "job", "compare"])
def test_a_phone_scrolls_down_and_never_aside(
    browser: Browser, stack: Stack, refined: Job, name: str
) -> None:
    with watched_page(browser, stack.url, viewport=PHONE) as (page, faults):
        open_page(page, name, refined)
        if name == "job":
            keep_picture(page, "phone", height=1400)

        assert page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]
        assert serious_violations(page) == []
    assert faults.said == []


def tabbed(page: Page, presses: int) -> set[str]:
    """Names, ids and classes of what is reached by pressing Tab."""
    reached: set[str] = set()
    for _ in range(presses):
        page.keyboard.press("Tab")
        reached.add(page.evaluate("document.activeElement.name || document.activeElement.id"))
        reached.add(page.evaluate("document.activeElement.className"))
    return reached


def test_everything_on_the_jobs_page_is_reached_by_the_keyboard(page: Page, refined: Job) -> None:
    open_page(page, "jobs", refined)
    page.keyboard.press("Tab")
    expect(page.get_by_role("link", name="Skip to content")).to_be_focused()
    assert {"new-job", "name", "order", "theme", "pair", "part fail"} <= tabbed(page, 30)

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


def test_what_got_worse_comes_first(page: Page, client: Client, ball: MeshFile) -> None:
    vertices, faces = shapes.sphere()
    for amount in (0.01, 0.03):
        source = MeshFile("part.obj", shapes.obj(shapes.noisy(vertices, amount), faces))
        job = client.submit(source, ball, {"mode": "measure"}, labels=["worse"])
        client.wait(job.id)
    page.goto("/compare?label=worse")

    rows = page.locator(".verdict.fail tbody tr")
    expect(rows.first).to_contain_text("part.obj → ball.obj")
    expect(page.get_by_role("heading", name="worse than in the run before")).to_be_visible()
    expect(page.locator(".charts .dot.bad").first).to_be_visible()
    keep_picture(page, "compare", height=1000)


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
