"""The pages of a server that asks for API keys, before there is any job."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, expect

from meshcone.files import MeshFile
from service.client import Client
from service.stack import Stack
from tests.acceptance.dashboard.browsing import watched_page
from worker.settings import WorkerSettings


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stack]:
    """A service that asks for keys although only this machine reaches it."""
    directory = tmp_path_factory.mktemp("guarded")
    running = Stack(WorkerSettings(data_dir=directory), log=directory / "service.log")
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("MESHCONE_REQUIRE_KEYS", "always")
        running.start()  # whatever else starts while it lives is to have no such environment
    try:
        yield running
    finally:
        running.stop()


@pytest.fixture(scope="module")
def key(guarded: Stack) -> str:
    return made_key(guarded, "read")


def made_key(guarded: Stack, scopes: str) -> str:
    made = subprocess.run(
        [sys.executable, "-m", "service.cli", "keys", "create", "a visitor", "--scopes", scopes],
        env={**os.environ, "MESHCONE_REDIS_URL": guarded.redis_url},
        capture_output=True,
        text=True,
        timeout=240,
        check=True,
    )
    return next(line.split()[-1] for line in made.stdout.splitlines() if line.startswith("key "))


def test_a_key_is_asked_for_once_and_then_used(browser: Browser, guarded: Stack, key: str) -> None:
    with watched_page(browser, guarded.url) as (page, faults):
        page.goto("/")
        expect(page.get_by_role("dialog")).to_be_visible()
        page.get_by_role("textbox", name="API key").fill(key)
        page.get_by_role("button", name="Use it").click()

        expect(page.get_by_text("No jobs yet")).to_be_visible()
        expect(page.get_by_text("meshcone submit")).to_be_visible()
        page.goto("/compare")
        expect(page.get_by_text("No job has a label yet")).to_be_visible()
        expect(page.get_by_role("dialog")).to_be_hidden()
        assert faults.elsewhere == []


def test_a_wrong_key_is_asked_for_again(browser: Browser, guarded: Stack, key: str) -> None:
    with watched_page(browser, guarded.url) as (page, _):
        page.goto("/jobs/unknown")
        page.get_by_role("textbox", name="API key").fill("mesh.wrong")
        page.get_by_role("button", name="Use it").click()
        expect(page.get_by_role("textbox", name="API key")).to_be_visible()
        page.get_by_role("textbox", name="API key").fill(key)
        page.get_by_role("button", name="Use it").click()

        expect(page.get_by_text("There is no such job")).to_be_visible()


def test_what_no_header_can_carry_is_refused_as_a_key_before_it_is_used(
    browser: Browser, guarded: Stack, key: str
) -> None:
    with watched_page(browser, guarded.url) as (page, _):
        page.goto("/jobs/unknown")
        typed = page.get_by_role("textbox", name="API key")
        typed.fill("mesh.copied…")
        page.get_by_role("button", name="Use it").click()
        expect(page.get_by_text("This is no key")).to_be_visible()
        typed.fill(key)
        page.get_by_role("button", name="Use it").click()

        expect(page.get_by_text("There is no such job")).to_be_visible()


def test_pictures_in_the_list_are_fetched_with_the_key(
    browser: Browser, guarded: Stack, rough_ball: MeshFile, ball: MeshFile
) -> None:
    key = made_key(guarded, "read,submit")
    with Client(guarded.url, api_key=key) as client:
        options = {"mode": "measure", "quality": {"samples": 500, "emd_samples": 16}}
        client.wait(client.submit(rough_ball, ball, options).id)
    with watched_page(browser, guarded.url) as (page, faults):
        page.goto("/")
        page.get_by_role("textbox", name="API key").fill(key)
        page.get_by_role("button", name="Use it").click()

        picture = page.locator("#rows img.thumb")
        expect(picture).to_have_attribute("src", re.compile("^data:image/webp;base64,"))
        assert picture.evaluate("image => image.decode().then(() => image.naturalWidth)") == 112
        refused = [said for said in faults.said if "401" not in said]
        assert (refused, faults.elsewhere) == ([], [])
