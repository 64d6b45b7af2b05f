"""A batch on the page of jobs: one row, which opens."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from meshcone.files import MeshFile
from service.api.batch_schemas import Batch
from service.client import Client
from service.stack import Stack
from tests.acceptance.dashboard.barriers import barriers
from tests.acceptance.dashboard.browsing import DESKTOP, PHONE, keep_picture, watched_page
from tests.holding import Hold

HEADER = {
    "options": {"mode": "measure", "audit": False, "quality": {"samples": 256, "emd_samples": 16}},
    "gates": {"point_to_surface.max": {"max": 0.01}},
}
SendPairs = Callable[..., Batch]


@pytest.fixture(scope="session")
def send_pairs(stack: Stack, ball: MeshFile, rough_ball: MeshFile) -> SendPairs:
    """Sends a batch of some pairs by name; those of the name ``rough`` do not pass their gate."""

    def send(*names: str, source: MeshFile | None = None, **header: object) -> Batch:
        with Client(stack.url) as client:
            reference = client.upload(ball).model_dump()
            sources = {
                name: client.upload(
                    source or (rough_ball if name == "rough" else ball)
                ).model_dump()
                for name in names
            }
            pairs = [
                {"name": name, "source": sources[name], "reference": reference} for name in names
            ]
            return client.submit_batch(pairs, {**HEADER, **header})

    return send


@pytest.fixture(scope="session")
def ended(stack: Stack, send_pairs: SendPairs) -> Batch:
    """A batch of three pairs, of which the first does not pass."""
    batch = send_pairs("rough", "vase", "mug", name="nightly pairs", labels=["of a night"])
    with Client(stack.url) as client:
        return client.wait_for_batch(batch.id, interval=0.2)


def row_of(page: Page, batch: Batch) -> Locator:
    return page.locator(f"tr[data-batch='{batch.id}']")


def jobs_within(page: Page) -> Locator:
    return page.locator("#rows tr.within[data-id]")


def test_a_batch_is_one_row_that_opens_to_its_jobs_those_that_failed_first(
    page: Page, ended: Batch
) -> None:
    page.goto("/?label=of+a+night")
    row = row_of(page, ended)
    expect(page.locator("#rows tr")).to_have_count(1)
    expect(row).to_contain_text("nightly pairs batch of 3 pairs")
    expect(row.locator(".chip.fail")).to_be_visible()
    expect(row).to_contain_text("1 fail · 2 pass")

    row.get_by_role("button", name="nightly pairs").click()
    expect(jobs_within(page)).to_have_count(3)
    expect(jobs_within(page).first).to_contain_text("rough")
    assert page.url.endswith(f"/?label=of+a+night&batch={ended.id}")
    keep_picture(page, "batch")

    page.reload()
    expect(jobs_within(page)).to_have_count(3)
    page.go_back()
    expect(row.get_by_role("button")).to_have_attribute("aria-expanded", "false")
    expect(jobs_within(page)).to_have_count(0)


def test_a_batch_is_opened_and_left_by_the_keyboard(page: Page, ended: Batch) -> None:
    page.goto("/?label=of+a+night")
    toggle = row_of(page, ended).get_by_role("button")
    toggle.focus()
    page.keyboard.press("Enter")

    expect(jobs_within(page)).to_have_count(3)
    expect(toggle).to_be_focused()
    expect(toggle).to_have_attribute("aria-expanded", "true")
    jobs_within(page).first.get_by_role("checkbox").focus()
    page.keyboard.press("Shift+ArrowDown")
    expect(page.get_by_text("2 jobs chosen")).to_be_visible()
    page.keyboard.press("Escape")
    toggle.press("Enter")
    expect(jobs_within(page)).to_have_count(0)


def test_a_filter_shows_the_batches_that_have_such_jobs_and_of_these_those_jobs(
    page: Page, ended: Batch
) -> None:
    page.goto(f"/?label=of+a+night&batch={ended.id}")
    expect(jobs_within(page)).to_have_count(3)

    page.get_by_role("button", name=re.compile("^Fail")).click()
    expect(jobs_within(page)).to_have_count(1)
    expect(jobs_within(page)).to_contain_text("rough")
    row_of(page, ended).get_by_role("button", name="nightly pairs").click()
    page.get_by_role("button", name=re.compile("^Canceled")).click()
    expect(page.get_by_text("No job is like that")).to_be_visible()


def test_failures_first_lists_jobs_which_lead_to_their_batch(page: Page, ended: Batch) -> None:
    page.goto("/?label=of+a+night&order=failures")
    jobs = page.locator("#rows tr[data-id]")
    expect(jobs).to_have_count(3)
    expect(jobs.first).to_contain_text("rough")

    jobs.first.get_by_role("link", name="its batch").click()
    expect(row_of(page, ended).get_by_role("button")).to_have_attribute("aria-expanded", "true")
    expect(jobs_within(page)).to_have_count(3)


def test_the_verdicts_of_a_batch_are_files_to_keep(page: Page, ended: Batch) -> None:
    page.goto(f"/?batch={ended.id}")

    with page.expect_download() as download:
        page.get_by_role("link", name="JUnit").click()
    assert b"<testsuites" in download.value.path().read_bytes()


def test_a_batch_is_followed_canceled_and_deleted(
    page: Page, client: Client, hold: Hold, send_pairs: SendPairs, ball: MeshFile
) -> None:
    client.submit(hold.mesh(ball), ball)  # keeps the one worker from what comes here
    page.goto("/?label=given+up")
    batch = send_pairs("vase", "mug", labels=["given up"])
    row = row_of(page, batch)
    expect(row).to_contain_text("0 of 2 ended")
    row.get_by_role("button", name="Batch of 2 pairs").click()
    expect(jobs_within(page).locator(".chip.queued")).to_have_count(2)

    page.get_by_role("button", name="Cancel batch").click()
    expect(row.locator(".chip.error")).to_be_visible()
    expect(row).to_contain_text("2 canceled")
    expect(jobs_within(page).locator(".chip.canceled")).to_have_count(2)

    page.on("dialog", lambda dialog: dialog.accept())
    page.get_by_role("button", name="Delete batch").click()
    expect(page.get_by_text("No job is like that")).to_be_visible()
    assert list(client.all_jobs(label="given up")) == []


@pytest.mark.parametrize("viewport", [DESKTOP, PHONE], ids=["desktop", "phone"])
def test_an_open_batch_has_no_serious_barrier_and_fits_a_phone(
    browser: Browser, stack: Stack, ended: Batch, viewport: dict[str, int]
) -> None:
    with watched_page(browser, stack.url, scheme="dark", viewport=viewport) as (page, faults):
        page.goto(f"/?label=of+a+night&batch={ended.id}")
        expect(jobs_within(page)).to_have_count(3)

        assert barriers(page) == []
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert faults.said == []


def test_a_batch_that_is_not_there_is_said(browser: Browser, stack: Stack) -> None:
    with watched_page(browser, stack.url) as (page, _):  # a refusal is an error on the console
        page.goto("/?batch=01a22aa5-c20e-711a-9c47-984ad884e8f6")

        expect(page.get_by_role("alert")).to_have_text("there is no such batch")
        expect(page.locator("#live")).to_have_text("live")
