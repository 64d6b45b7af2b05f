"""The pages of a server that asks for API keys, before there is any job."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, expect

from service.stack import Stack
from tests.acceptance.dashboard.browsing import watched_page
from worker.settings import WorkerSettings


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stack]:
    """A service that asks for keys although only this machine reaches it."""
    directory = tmp_path_factory.mktemp("guarded")
    patch = pytest.MonkeyPatch()
    patch.setenv("MESHCONE_REQUIRE_KEYS", "always")
    with Stack(WorkerSettings(data_dir=directory), log=directory / "service.log") as running:
        yield running
    patch.undo()


@pytest.fixture(scope="module")
def key(guarded: Stack) -> str:
    made = subprocess.run(
        [sys.executable, "-m", "service.cli", "keys", "create", "a visitor", "--scopes", "read"],
        env={**os.environ, "MESHCONE_REDIS_URL": guarded.redis_url},
        capture_output=True,
        text=True,
        timeout=60,
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
