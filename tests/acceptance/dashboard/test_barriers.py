"""Barriers to people who see, read or point differently, looked for by axe-core on every page.

A page is walked through with all that opens on it: dialogs, tabs, colours, layouts. The page is
looked at in light and dark, on a desk and on a phone; what opens on it in light on a desk and in
dark on a phone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Literal

import pytest
from playwright.sync_api import Browser, Page

from meshcone.files import MeshFile
from service.api.schemas import Job
from service.client import Client
from service.dashboard.documentation import BUILT, Documentation
from service.stack import Stack
from tests.acceptance.dashboard.barriers import barriers
from tests.acceptance.dashboard.browsing import (
    DESKTOP,
    PHONE,
    open_tab,
    settle,
    watched_page,
)
from tests.painted import encoded, painted, picture

SIDES: tuple[tuple[dict[str, int], Literal["light", "dark"]], ...] = (
    (DESKTOP, "light"),
    (DESKTOP, "dark"),
    (PHONE, "light"),
    (PHONE, "dark"),
)


def as_it_is(_: Page) -> None:
    """Leave the page alone."""


@dataclass(frozen=True)
class Step:
    """Something that a page can be made to show.

    Attributes:
        name: what a failure calls it.
        show: brings it about.
        part: the selector of what is new in it; None for the whole page.
        undo: takes away what would cover the next step.
    """

    name: str
    show: Callable[[Page], object]
    part: str | None = None
    undo: Callable[[Page], object] = as_it_is


@dataclass(frozen=True)
class Walk:
    """A page and its steps; ``path`` may name the jobs there are."""

    path: str
    ready: str
    steps: tuple[Step, ...]


def pressing(part: str, *names: str) -> Step:
    """A step that presses buttons, one after the other."""

    def show(page: Page) -> None:
        for name in names:
            page.get_by_role("button", name=name, exact=True).click()

    return Step(", ".join(names), show, part)


def tab(name: str) -> Step:
    """A step that opens a tab with all that is folded in it."""

    def show(page: Page) -> None:
        open_tab(page, name)
        unfold(page, "[role=tabpanel]:not([hidden])")

    return Step(f"tab {name}", show, "[role=tabpanel]:not([hidden])")


def dialog(name: str, show: Callable[[Page], object]) -> Step:
    """A step that opens a dialog, which Escape closes."""
    return Step(name, show, "dialog[open]", lambda page: page.keyboard.press("Escape"))


def unfold(page: Page, part: str) -> None:
    """Open all that is folded in a part of the page."""
    page.locator(part).evaluate_all(
        "parts => parts.forEach(part => part.querySelectorAll('details')"
        ".forEach(each => { each.open = true; }))"
    )


def show_new_job(page: Page) -> None:
    page.locator("#new-job").click()
    page.get_by_role("button", name="Fill in a sample").click()
    page.locator("#options > summary").click()
    page.wait_for_selector("#options-form .section")
    unfold(page, "#new-dialog")


def show_run_again(page: Page) -> None:
    page.get_by_role("button", name="Run again").click()
    page.wait_for_selector("dialog[open] .section")
    unfold(page, "dialog[open]")


def show_operation(page: Page) -> None:
    page.get_by_text("Submit a mesh and its reference").click()
    page.get_by_role("button", name="Try it out").click()


def show_authorization(page: Page) -> None:
    page.get_by_role("button", name="Authorize").first.click()
    page.wait_for_selector(".dialog-ux .modal-ux")


FIRST = Step("as it opens", as_it_is)
WALKS = {
    "jobs": Walk(
        "/",
        "#rows tr[data-id]",
        (
            FIRST,
            Step("chosen", lambda page: page.locator("#choose-all").check(), "#selected"),
            dialog("new job", show_new_job),
            Step(
                "asked for a key",
                lambda page: page.locator("#key-dialog").evaluate("one => one.showModal()"),
                "#key-dialog",
            ),
        ),
    ),
    "job": Walk(
        "/jobs/{refined}",
        "[data-ready]",
        (
            FIRST,
            pressing(".stage", "Wipe", "Signed"),
            pressing(".stage", "Blink", "Cone tension"),
            pressing(".stage", "Overlay", "Shape", "Measure between two points"),
            *map(tab, ("Changes", "Metrics", "Audit", "Solver", "Files")),
            dialog("run again", show_run_again),
        ),
    ),
    "colours": Walk(
        "/jobs/{coloured}",
        "[data-ready]",
        (
            FIRST,
            pressing(".stage", "UV", "One"),
            pressing(".stage", "Textures"),
            tab("Changes"),
        ),
    ),
    "failed": Walk("/jobs/{failed}", "#job .verdict", (FIRST,)),
    "unknown": Walk("/jobs/nobody", "#job .empty", (FIRST,)),
    "compare": Walk(
        "/compare?label=jugs",
        ".trends .plot",
        (FIRST, Step("all values", lambda page: unfold(page, ".asset"), ".asset")),
    ),
    "two": Walk(
        "/compare?jobs={measured},{refined}",
        "[data-ready]",
        (FIRST, pressing(".pair", "Difference"), pressing(".pair", "Shape")),
    ),
    "docs": Walk(
        "/docs",
        ".opblock",
        (
            FIRST,
            Step("an operation", show_operation, ".opblock.is-open"),
            Step("authorization", show_authorization, ".dialog-ux"),
        ),
    ),
    "help": Walk(
        "/help/thresholds/",
        "article",
        (FIRST,),  # the search's own looks cannot be changed from here
    ),
}


@pytest.fixture(scope="module")
def jobs(
    stack: Stack, refined: Job, rough_jug: MeshFile, jug: MeshFile
) -> Iterator[dict[str, str]]:
    """The ids of the jobs that the pages show, by what they are for."""
    quick: dict[str, Any] = {"mode": "measure", "quality": {"samples": 500, "emd_samples": 16}}
    with Client(stack.url) as client:
        white, globe = (
            MeshFile(f"{name}.gltf", painted(image))
            for name, image in (("white", None), ("globe", encoded(picture())))
        )
        gates = {"appearance.color_difference.p95": {"max": 10}}
        sent = {
            "measured": client.submit(rough_jug, jug, quick, labels=["jugs"]),
            "coloured": client.submit(white, globe, {**quick, "gates": gates}),
            "failed": client.submit(MeshFile("blank.obj", b"\n" * 16 * 2**20), jug),
        }
        yield {name: client.wait(job.id).id for name, job in sent.items()} | {"refined": refined.id}


def looked_at(page: Page, step: Step) -> Iterator[str]:
    """What is wrong with what a page shows; a part is looked at from two of the four sides."""
    for width, scheme in SIDES if step.part is None else SIDES[::3]:
        page.set_viewport_size({"width": width["width"], "height": width["height"]})
        page.emulate_media(color_scheme=scheme, reduced_motion="reduce")
        settle(page)
        side = f"{step.name}, {width['width']} pixels, {scheme}"
        for found in barriers(page, step.part):
            yield f"{side}: {found}"
        wide = page.evaluate("document.documentElement.scrollWidth")
        if wide > width["width"]:
            yield f"{side}: scrolls aside, {wide} pixels wide"


@pytest.mark.parametrize("name", WALKS)
def test_no_serious_barrier_wherever_one_goes(
    browser: Browser, stack: Stack, jobs: dict[str, str], name: str
) -> None:
    if name == "help" and not Documentation(BUILT):
        pytest.skip("the documentation was not built; `make site` builds it")
    walk = WALKS[name]
    found = []
    with watched_page(browser, stack.url) as (page, _):
        page.goto(walk.path.format(**jobs))
        page.wait_for_selector(walk.ready)
        for step in walk.steps:
            page.set_viewport_size({"width": DESKTOP["width"], "height": DESKTOP["height"]})
            step.show(page)
            found += looked_at(page, step)
            step.undo(page)

    assert found == []
