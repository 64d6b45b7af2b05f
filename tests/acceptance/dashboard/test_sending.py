"""Choosing and sending a job, and what may go wrong on the way: nothing is lost or left unsaid."""

from __future__ import annotations

import io
import os
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from service.stack import Stack
from tests.acceptance.dashboard.browsing import drop, watched_page
from tests.acceptance.dashboard.made_rows import Held, job

CORNER = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


@pytest.fixture
def failing(browser: Browser, stack: Stack) -> Iterator[Page]:
    """A page on which something is refused: an error on its console."""
    with watched_page(browser, stack.url) as (page, _):
        yield page


def slot(page: Page, side: str) -> Locator:
    return page.locator(f".slot[data-slot={side}]")


def start(page: Page) -> Locator:
    return page.locator("#send")


def test_what_is_dropped_during_an_upload_is_for_the_next_job(page: Page) -> None:
    uploads = Held().on(page, "**/v1/jobs")
    page.goto("/")
    drop(page, "#drop", {"one.obj": CORNER})
    start(page).click()
    expect(page.locator("#submit-state")).to_contain_text("Sending one.obj")

    drop(page, "#drop", {"two.obj": CORNER, "two.mtl": b"newmtl a\n"})
    expect(slot(page, "source")).to_contain_text("two.obj")
    expect(start(page)).to_be_disabled()
    uploads.wait(page)
    uploads.routes[0].fulfill(status=202, json=job(1, source={"name": "one.obj"}))

    expect(page.locator("#submit-state")).to_contain_text("Accepted: one.obj")
    expect(start(page)).to_be_enabled()
    expect(slot(page, "source")).to_contain_text("two.obj")
    expect(slot(page, "source")).to_contain_text("two.mtl")
    assert len(uploads.requests) == 1


def test_a_job_is_not_sent_twice_when_its_sides_are_swapped_during_the_upload(page: Page) -> None:
    page.route("**/v1/jobs", lambda _: None)
    page.goto("/")
    drop(page, "#drop", {"one.obj": CORNER, "two.obj": CORNER})
    start(page).click()

    page.get_by_role("button", name="Swap source and reference").click()

    expect(start(page)).to_be_disabled()


def test_what_was_refused_is_chosen_still(failing: Page) -> None:
    page = failing
    page.route("**/v1/jobs", lambda route: route.fulfill(status=400, json={"detail": "no faces"}))
    page.goto("/")
    drop(page, "#drop", {"one.obj": CORNER, "paint.mtl": b"newmtl a\n"})
    start(page).click()

    expect(page.locator("#submit-state")).to_contain_text("no faces")
    expect(slot(page, "source")).to_contain_text("one.obj")
    expect(slot(page, "source")).to_contain_text("paint.mtl")
    expect(start(page)).to_be_enabled()


def test_what_was_refused_can_be_chosen_again_when_another_took_its_place(failing: Page) -> None:
    page = failing
    uploads = Held().on(page, "**/v1/jobs")
    page.goto("/")
    drop(page, "#drop", {"one.obj": CORNER})
    start(page).click()
    drop(page, "#drop", {"two.obj": CORNER})
    expect(slot(page, "source")).to_contain_text("two.obj")
    uploads.wait(page)
    uploads.routes[0].fulfill(status=400, json={"detail": "no faces"})
    expect(page.locator("#submit-state")).to_contain_text("no faces")
    expect(slot(page, "source")).to_contain_text("two.obj")

    page.get_by_role("button", name="Choose one.obj again").click()

    expect(slot(page, "source")).to_contain_text("one.obj")


def test_a_refusal_after_the_dialog_was_closed_is_told_on_the_page(failing: Page) -> None:
    page = failing
    uploads = Held().on(page, "**/v1/jobs")
    page.goto("/")
    drop(page, "#drop", {"one.obj": CORNER})
    start(page).click()
    page.get_by_role("button", name="Close").click()
    uploads.wait(page)
    uploads.routes[0].fulfill(status=400, json={"detail": "no faces"})

    expect(page.locator("#sent")).to_contain_text("one.obj was not sent: no faces")
    page.get_by_role("button", name="Show it").click()
    expect(slot(page, "source")).to_contain_text("one.obj")


def test_an_upload_is_told_of_on_the_page_while_the_dialog_is_closed(page: Page) -> None:
    page.route("**/v1/jobs", lambda _: None)
    page.goto("/")
    drop(page, "#drop", {"one.obj": CORNER})
    start(page).click()
    page.get_by_role("button", name="Close").click()
    expect(page.locator("#sent")).to_contain_text("Sending one.obj")

    page.get_by_role("button", name="New job").click()

    expect(page.locator("#submit-state")).to_contain_text("Sending one.obj")
    expect(page.locator("#sent")).to_be_empty()


def test_a_page_that_is_left_during_an_upload_asks_first(page: Page) -> None:
    uploads = Held().on(page, "**/v1/jobs")
    asks = "!dispatchEvent(new Event('beforeunload', { cancelable: true }))"
    page.goto("/")
    drop(page, "#drop", {"one.obj": CORNER})
    assert not page.evaluate(asks)
    start(page).click()
    uploads.wait(page)
    assert page.evaluate(asks)

    uploads.routes[0].fulfill(status=202, json=job(1, source={"name": "one.obj"}))
    expect(page.locator("#sent")).to_contain_text("Accepted: one.obj")
    assert not page.evaluate(asks)


def test_an_upload_that_is_stopped_leaves_what_was_chosen(failing: Page) -> None:
    page = failing
    page.add_init_script("XMLHttpRequest.prototype.send = () => {}")  # one that never gets anywhere
    page.goto("/")
    drop(page, "#drop", {"one.obj": CORNER})
    start(page).click()

    page.get_by_role("button", name="Stop").click()

    expect(page.locator("#submit-state")).to_contain_text("It was stopped before it was whole")
    expect(slot(page, "source")).to_contain_text("one.obj")
    expect(start(page)).to_be_focused()


def test_what_was_refused_is_said_no_more_when_another_file_is_chosen(failing: Page) -> None:
    page = failing
    page.route("**/v1/jobs", lambda route: route.fulfill(status=400, json={"detail": "no faces"}))
    page.goto("/")
    drop(page, "#drop", {"one.obj": CORNER})
    start(page).click()
    expect(page.locator("#submit-state")).to_contain_text("no faces")
    expect(start(page)).to_be_focused()

    drop(page, "#drop .slot[data-slot=source]", {"two.obj": CORNER})

    expect(page.locator("#submit-state")).to_be_empty()


def test_a_file_that_has_changed_since_it_was_chosen_is_named(
    failing: Page, tmp_path: Path
) -> None:
    page = failing
    mesh = tmp_path / "edited.obj"
    mesh.write_bytes(CORNER)
    page.goto("/")
    page.get_by_test_id("source-input").set_input_files(mesh)
    expect(slot(page, "source")).to_contain_text("edited.obj")
    mesh.write_bytes(CORNER + b"# exported again\n")
    os.utime(mesh, (2_000_000_000, 2_000_000_000))  # whatever the clock of the disk shows

    start(page).click()

    expect(page.locator("#submit-state")).to_contain_text(
        "edited.obj has changed since it was chosen, or is gone. Choose it again."
    )


@pytest.mark.parametrize("method", [zipfile.ZIP_DEFLATED, zipfile.ZIP_STORED])
def test_a_damaged_zip_is_told_by_name(page: Page, method: int) -> None:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", method) as archive:
        archive.writestr("new/a.obj", CORNER * 50)
        archive.writestr("old/a.obj", CORNER * 50)
    damaged = bytearray(packed.getvalue())
    first = damaged.index(b"new/a.obj") + len(b"new/a.obj")
    damaged[first : first + 12] = b"\xff" * 12
    page.goto("/")

    drop(page, "main", {"pair.zip": bytes(damaged)})

    expect(page.get_by_role("dialog")).to_contain_text(
        "pair.zip is damaged: new/a.obj in it cannot be unpacked"
    )
    expect(start(page)).to_be_disabled()


def test_a_folder_that_cannot_be_read_is_told_by_name(page: Page) -> None:
    page.add_init_script(
        """DataTransferItem.prototype.webkitGetAsEntry = () => ({
            name: "locked",
            isDirectory: true,
            createReader: () => ({ readEntries: (_, refuse) => refuse(new Error("no leave")) }),
        });"""
    )
    page.goto("/")

    drop(page, "main", {"any.obj": CORNER})

    expect(page.get_by_role("dialog")).to_contain_text("locked cannot be read")
    expect(page.get_by_role("dialog")).to_contain_text("no leave")


def test_a_third_mesh_is_left_out_in_words(page: Page) -> None:
    page.goto("/")

    drop(page, "main", {f"lod{level}.obj": CORNER for level in range(3)})

    expect(slot(page, "source")).to_contain_text("lod0.obj")
    expect(slot(page, "reference")).to_contain_text("lod1.obj")
    expect(page.locator("#take-state")).to_contain_text("Left out: lod2.obj.")


def test_an_invalid_option_is_shown_where_its_section_is_closed(page: Page) -> None:
    page.goto("/")
    drop(page, "#drop", {"one.obj": CORNER})
    options = page.get_by_text("all at their defaults")
    options.click()
    section = page.get_by_text("Constraints every answer")
    section.click()
    wrong = page.get_by_label("max displacement")
    wrong.fill("-7")
    section.click()
    page.locator("#options > summary").click()
    expect(wrong).to_be_hidden()

    start(page).click()

    expect(wrong).to_be_visible()
    expect(wrong).to_be_focused()


def test_a_value_that_is_a_word_or_a_number_is_asked_for_in_one_line(page: Page) -> None:
    page.goto("/")
    page.get_by_role("button", name="New job").click()
    page.locator("#options summary").first.click()

    scene = page.locator("#option-scene")

    expect(scene).to_have_attribute("type", "text")
    expect(scene).to_have_attribute("placeholder", "not set")


def test_a_link_that_is_dragged_raises_no_veil_and_may_go_into_the_search(page: Page) -> None:
    page.goto("/")

    goes_on = page.evaluate(
        """() => {
            const dataTransfer = new DataTransfer();
            dataTransfer.setData("text/plain", "a link");
            const drag = { dataTransfer, bubbles: true, cancelable: true };
            const field = document.querySelector("[name=name]");
            return ["dragenter", "dragover", "drop"].map(
                (kind) => field.dispatchEvent(new DragEvent(kind, drag)));
        }"""
    )

    assert goes_on == [True, True, True]  # not taken from the field
    expect(page.locator("#veil")).to_be_hidden()
    expect(page.get_by_role("dialog")).to_be_hidden()
