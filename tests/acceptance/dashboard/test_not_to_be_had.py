"""What cannot be had for once is said where it was asked for, and takes nothing else along."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page, Route, expect

from service.api.schemas import Job
from service.stack import Stack
from tests.acceptance.dashboard.browsing import difference, open_tab, pixels, watched_page

BUSY = {"title": "busy", "detail": "try again later", "status": 503}
GONE = {"title": "gone", "detail": "there is no such file", "status": 404}


@pytest.fixture
def refusing(browser: Browser, stack: Stack) -> Iterator[Page]:
    """A page whose server refuses something, which is an error on the console."""
    with watched_page(browser, stack.url) as (opened, faults):
        yield opened
    assert [said for said in faults.said if "Failed to load resource" not in said] == []


def with_more_triangles(route: Route) -> None:
    """The preview, saying that the mesh has more triangles than are in it."""
    preview = route.fetch().body()
    [faces] = re.findall(rb'"faces":\{[^}]*\}', preview)
    more = preview.replace(faces, re.sub(rb"\d", b"9", faces))  # as long as it was
    route.fulfill(body=more, content_type="model/gltf-binary")


def test_a_whole_mesh_that_cannot_be_had_leaves_the_view_and_can_be_asked_for_again(
    refusing: Page, refined: Job
) -> None:
    refusing.route("**/preview.glb", with_more_triangles)
    refusing.route("**/heatmap.glb", lambda route: route.fulfill(status=503, json=BUSY), times=1)
    refusing.goto(f"/jobs/{refined.id}")
    refusing.wait_for_selector("[data-ready]")
    whole = refusing.get_by_role("button", name="Show every triangle")
    note = refusing.locator(".view-note")

    whole.click()
    expect(note).to_have_text("The whole mesh cannot be shown: try again later")
    expect(refusing.locator(".view .over")).to_be_hidden()
    expect(refusing.locator(".places button").first).to_be_enabled()

    whole.click()
    expect(note).to_have_text(re.compile("^refined: all"))
    expect(note).not_to_have_class(re.compile("error"))


def with_a_place(route: Route) -> None:
    """The report, saying where its first check was decided."""
    report = route.fetch().json()
    report["gates"]["checks"][0]["position"] = [0, 0, 0]
    route.fulfill(json=report)


def test_meshes_that_cannot_be_had_can_be_asked_for_again_and_nothing_leads_to_them(
    refusing: Page, refined: Job
) -> None:
    refusing.route(f"**{refined.links.report}", with_a_place)
    refusing.route("**/preview.glb", lambda route: route.abort(), times=1)
    refusing.goto(f"/jobs/{refined.id}")
    show = refusing.get_by_role("button", name="Show where").first
    told = refusing.locator(".view .over")
    expect(told).to_contain_text("The meshes cannot be shown: The server does not answer.")
    expect(show).to_be_disabled()

    refusing.get_by_role("button", name="Try again").click()

    refusing.wait_for_selector("[data-ready]")
    expect(told).to_be_hidden()
    expect(show).to_be_enabled()
    expect(refusing.locator(".places button").first).to_be_enabled()


def test_graphics_that_the_browser_takes_away_are_missed_in_words_and_drawn_again(
    job_page: Page,
) -> None:
    canvas = job_page.locator(".view canvas")
    before = pixels(canvas)
    job_page.evaluate(
        "() => { const drawn = document.querySelector('.view canvas').getContext('webgl2');"
        " window.graphics = drawn.getExtension('WEBGL_lose_context'); graphics.loseContext(); }"
    )
    expect(job_page.get_by_role("alert")).to_contain_text("taken the graphics away")
    job_page.get_by_role("button", name="Save a picture").dispatch_event("click")
    expect(job_page.locator(".view-note")).to_contain_text("There is no picture")

    job_page.evaluate("graphics.restoreContext()")
    expect(job_page.locator(".view .over")).to_be_hidden()
    assert difference(before, pixels(canvas)) < 2.0


def test_a_file_that_has_gone_is_said_beside_its_link(refusing: Page, refined: Job) -> None:
    refusing.goto(f"/jobs/{refined.id}")
    open_tab(refusing, "Files")
    refusing.evaluate("sessionStorage.setItem('meshcone.key', 'a.key')")
    refusing.route("**/mesh", lambda route: route.fulfill(status=404, json=GONE))

    refusing.get_by_role("link", name="jug_scan.refined.glb").click()

    expect(refusing.get_by_role("alert")).to_have_text(
        "This file cannot be had: there is no such file"
    )
