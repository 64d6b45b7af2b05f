"""The page of a job that goes on while its page is left, and what a refused button does."""

from __future__ import annotations

import json
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, Route, expect

from meshcone.files import MeshFile
from service.api.schemas import Job
from service.client import Client
from service.stack import Stack
from tests.acceptance.dashboard.browsing import watched_page
from tests.holding import Hold

REFUSED = {"title": "busy", "detail": "the broker cannot be reached", "status": 503}


def leave(page: Page) -> None:
    """What a browser tells a page that it keeps for the button Back."""
    page.evaluate("dispatchEvent(new PageTransitionEvent('pagehide', { persisted: true }))")


def come_back(page: Page) -> None:
    page.evaluate("dispatchEvent(new PageTransitionEvent('pageshow', { persisted: true }))")


def test_a_job_that_runs_when_its_page_is_left_is_followed_again_by_who_comes_back(
    page: Page, client: Client, hold: Hold, rough_ball: MeshFile, ball: MeshFile
) -> None:
    quick = {"effort": "fast", "quality": {"samples": 500, "emd_samples": 16}}
    job = client.submit(hold.mesh(rough_ball), ball, quick)
    page.goto(f"/jobs/{job.id}")
    expect(page.get_by_test_id("progress")).to_be_visible()

    leave(page)
    come_back(page)
    expect(page.get_by_test_id("progress")).to_be_visible()
    expect(page.get_by_text("failed")).to_have_count(0)

    hold.release()
    expect(page.get_by_test_id("verdict")).to_contain_text("its reference", timeout=60_000)


def test_a_job_that_ended_while_its_page_was_left_is_shown_as_it_ended(
    page: Page, client: Client, hold: Hold, rough_ball: MeshFile, ball: MeshFile
) -> None:
    job = client.submit(hold.mesh(rough_ball), ball)
    page.goto(f"/jobs/{job.id}")
    expect(page.get_by_test_id("progress")).to_be_visible()

    leave(page)
    client.cancel(job.id)
    hold.release()
    client.wait(job.id)
    come_back(page)

    expect(page.get_by_text("This job was canceled")).to_be_visible()


def test_a_page_that_told_how_the_job_ended_stays_as_it_is(page: Page, refined: Job) -> None:
    page.goto(f"/jobs/{refined.id}")
    page.wait_for_selector("[data-ready]")
    page.evaluate("document.querySelector('[data-ready]').dataset.mark = 'kept'")

    leave(page)
    come_back(page)

    expect(page.locator("[data-mark=kept]")).to_be_visible()


@pytest.mark.parametrize(("state", "button"), [("running", "Cancel"), ("failed", "Delete")])
def test_a_button_that_was_refused_can_be_tried_again(
    browser: Browser, stack: Stack, refined: Job, state: str, button: str
) -> None:
    answers = [503, 503, 204]

    def job(route: Route) -> None:
        asks = route.request.method == "GET"
        if asks and route.request.url.endswith("/events"):
            return  # nothing comes of a job for now
        shown = {"state": state, "finished": None, "error": None}
        if asks:
            document: dict[str, Any] = {**json.loads(refined.model_dump_json()), **shown}
            route.fulfill(json=document)
        else:
            status = answers.pop(0)
            route.fulfill(status=status, json=REFUSED if status == 503 else None)

    with watched_page(browser, stack.url) as (page, _):  # a refusal is an error on the console
        page.route(f"**/v1/jobs/{refined.id}**", job)
        page.on("dialog", lambda dialog: dialog.accept())
        page.goto(f"/jobs/{refined.id}")
        armed = page.get_by_role("button", name=button)
        for _ in range(2):
            armed.click()
            expect(page.get_by_role("alert").filter(has_text="the broker")).to_have_count(1)
            expect(armed).to_be_enabled()
        with page.expect_response(lambda answer: answer.status == 204):
            armed.click()
