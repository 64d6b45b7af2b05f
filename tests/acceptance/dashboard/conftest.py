"""One browser, one refined jug, and pages that may do nothing wrong."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect, sync_playwright

from meshcone.files import MeshFile
from service.api.schemas import Job
from service.client import Client
from service.demo import asset
from service.stack import Stack
from tests.acceptance.dashboard.browsing import launch, watched_page

expect.set_options(timeout=120_000)  # ms; a guard: a busy machine draws and solves when it can

GATES: dict[str, Any] = {
    "point_to_surface.max": {"max": 0.05},
    "point_to_surface.p95": {"max": 0.004},
    "normal_consistency": {"min": 0.95, "severity": "warning"},
}


@pytest.fixture(scope="package")
def browser() -> Iterator[Browser]:
    """Closed with this directory's last test: it draws, and would compete with all others."""
    with sync_playwright() as playwright:
        launched = launch(playwright)
        yield launched
        launched.close()


@pytest.fixture
def page(browser: Browser, stack: Stack) -> Iterator[Page]:
    """A page that reports no error and asks no other host for anything."""
    with watched_page(browser, stack.url) as (opened, faults):
        yield opened
    assert faults.said == []
    assert faults.elsewhere == []


@pytest.fixture(scope="session")
def jug() -> MeshFile:
    return MeshFile("jug.glb", asset.reference_glb())


@pytest.fixture(scope="session")
def rough_jug(jug: MeshFile) -> MeshFile:
    return MeshFile("jug_scan.glb", asset.degraded(jug.data))


@pytest.fixture(scope="session")
def refined(stack: Stack, rough_jug: MeshFile, jug: MeshFile) -> Job:
    """A refinement that has succeeded and passed its gates."""
    with Client(stack.url) as client:
        job = client.submit(rough_jug, jug, {"gates": GATES}, labels=["jugs"])
        return client.wait(job.id)


@pytest.fixture
def job_page(page: Page, refined: Job) -> Page:
    """The page of the refined jug, its meshes drawn."""
    page.goto(f"/jobs/{refined.id}")
    page.wait_for_selector("[data-ready]")
    return page
