"""Two exports with equal file names, dropped or chosen: each file stays with its mesh."""

from __future__ import annotations

import hashlib
import io
import zipfile
from collections.abc import Sequence
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from meshcone.files import MeshFile
from service.api.schemas import Job
from service.client import Client
from tests.acceptance.dashboard.browsing import drop, open_tab
from tests.acceptance.two_exports import two_exports, write_exports


@pytest.fixture
def exports(tmp_path: Path) -> Path:
    write_exports(tmp_path)
    return tmp_path


def drop_from_disk(page: Page, paths: Sequence[Path]) -> None:
    """Drop files and folders as a file manager does, which no script of a page can."""
    drag_from_disk(page, paths, "dragEnter", "dragOver", "drop")


def drag_from_disk(page: Page, paths: Sequence[Path], *kinds: str, x: int = 600) -> None:
    """Some steps of dragging files and folders over the middle of a page."""
    session = page.context.new_cdp_session(page)
    dragged = {"items": [], "files": [str(path) for path in paths], "dragOperationsMask": 1}
    for kind in kinds:
        session.send(
            "Input.dispatchDragEvent",
            {"type": kind, "x": x, "y": 400, "data": dragged},
        )


def sent(page: Page, client: Client, label: str) -> Job:
    """Send what was chosen under a label, and wait for its end."""
    page.get_by_label("Label").first.fill(label)
    page.get_by_role("button", name="Start the job").click()
    expect(page.get_by_role("link", name="Watch this job")).to_be_visible()
    [job] = client.jobs(label=label).jobs
    return client.wait(job.id)


def assert_apart(job: Job) -> None:
    """Each side has its own buffer, the spiked ball is the source."""
    assert job.state == "succeeded"
    for files, mesh in zip(
        (job.source_resources, job.reference_resources), two_exports(), strict=True
    ):
        digest = hashlib.sha256(mesh.resources["a.bin"]).hexdigest()
        assert [(file.name, file.sha256) for file in files] == [("a.bin", digest)]
    assert job.resources == []


def test_two_dropped_folders_are_the_two_sides(page: Page, client: Client, exports: Path) -> None:
    page.goto("/")
    drop_from_disk(page, [exports / "new", exports / "old"])
    expect(page.locator(".slot[data-slot=source]")).to_contain_text("new/a.gltf")
    expect(page.locator(".slot[data-slot=reference]")).to_contain_text("old/a.gltf")

    job = sent(page, client, "two folders")

    assert_apart(job)
    assert client.report(job.id)["outcome"] == "improved"


def test_what_is_dragged_is_over_the_veil_and_not_over_rows_that_are_drawn_anew(
    page: Page, exports: Path
) -> None:
    page.goto("/")
    drag_from_disk(page, [exports / "new"], "dragEnter", "dragOver")

    on_veil = page.evaluate("document.elementFromPoint(600, 400).closest('#veil') !== null")

    assert on_veil  # a drop on an element that has just been replaced is lost


def test_what_is_dragged_out_of_the_window_leaves_no_veil(page: Page, exports: Path) -> None:
    page.goto("/")
    drag_from_disk(page, [exports / "new"], "dragEnter", "dragOver")
    expect(page.locator("#veil")).to_be_visible()

    drag_from_disk(page, [exports / "new"], "dragOver", x=-20)

    expect(page.locator("#veil")).to_be_hidden()


def test_a_zip_of_two_exports_is_opened_and_its_folders_are_the_two_sides(
    page: Page, client: Client, exports: Path
) -> None:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in sorted(exports.glob("*/*")):
            archive.write(path, path.relative_to(exports))
    page.goto("/")
    drop(page, "main", {"both.zip": packed.getvalue()})
    expect(page.locator(".slot[data-slot=source]")).to_contain_text("both.zip/new/a.gltf")
    expect(page.locator(".slot[data-slot=reference]")).to_contain_text("both.zip/old/a.gltf")

    assert_apart(sent(page, client, "one zip"))


def test_files_chosen_for_a_side_belong_to_it(page: Page, client: Client, exports: Path) -> None:
    page.goto("/")
    for side, folder in (("source", "new"), ("reference", "old")):
        page.get_by_test_id(f"{side}-input").set_input_files(
            [exports / folder / "a.gltf", exports / folder / "a.bin"]
        )

    assert_apart(sent(page, client, "chosen for each side"))


def test_files_dropped_on_a_side_belong_to_it_and_follow_a_swap(page: Page, client: Client) -> None:
    new, old = two_exports()
    page.goto("/")
    for side, mesh in (("source", old), ("reference", new)):
        drop(page, f".slot[data-slot={side}]", {mesh.name: mesh.data, **mesh.resources})
    page.get_by_role("button", name="Swap source and reference").click()

    assert_apart(sent(page, client, "dropped on each side, and swapped"))


def test_another_mesh_for_a_side_leaves_the_buffers_of_the_first_out(page: Page) -> None:
    new, old = two_exports()
    page.goto("/")
    drop(page, ".slot[data-slot=source]", {new.name: new.data, "first.bin": b"1"})
    drop(page, ".slot[data-slot=source]", {old.name: old.data, **old.resources})

    expect(page.locator("[data-resources=source] li")).to_have_count(1)
    expect(page.locator("[data-resources=source]")).to_contain_text("a.bin")


def test_what_two_meshes_of_one_folder_name_is_for_both(
    page: Page, ball: MeshFile, rough_ball: MeshFile
) -> None:
    page.goto("/")
    meshes = {rough_ball.name: rough_ball.data, ball.name: ball.data}
    drop(page, "#drop", {**meshes, "paint.mtl": b"newmtl paint\n"})

    expect(page.locator("[data-resources=both]")).to_contain_text("paint.mtl")
    expect(page.locator("[data-resources=both]")).to_contain_text("for both")


def test_the_commands_of_a_job_find_each_file_in_the_folder_of_its_side(
    page: Page, client: Client
) -> None:
    job = client.wait(client.submit(*two_exports(), {"effort": "fast"}).id)
    page.goto(f"/jobs/{job.id}")

    open_tab(page, "Files")
    repeat = page.get_by_role("region", name="Command that repeats this job")
    for part in (
        "-F source=@source/a.gltf",
        "-F source_resources=@source/a.bin",
        "-F reference=@reference/a.gltf",
        "-F reference_resources=@reference/a.bin",
    ):
        expect(repeat).to_contain_text(part)
    open_tab(page, "Solver")
    verify = page.get_by_role("region", name="Command that verifies the certificate")
    expect(verify).to_contain_text("--source source/a.gltf --reference reference/a.gltf")


@pytest.mark.parametrize("name", ["model.fbx", "model.BLEND", "export.7z"])
def test_what_cannot_be_read_is_refused_by_name_and_no_attachment_of_another_mesh(
    page: Page, ball: MeshFile, name: str
) -> None:
    page.goto("/")
    drop(page, "#drop", {name: b"\x00", "ref.obj": ball.data})

    expect(page.locator("#take-state")).to_contain_text(f"Nothing was taken: {name} is of a kind")
    expect(page.locator(".slot.filled")).to_have_count(0)
    expect(page.locator(".resources li")).to_have_count(0)


def test_a_drop_without_a_mesh_is_said_to_lack_one(page: Page) -> None:
    page.goto("/")
    drop(page, "main", {"paint.mtl": b"newmtl paint\n"})

    expect(page.locator("#intent")).to_contain_text("No mesh yet: paint.mtl is what a mesh names")


def test_a_chosen_mesh_is_taken_out_again_with_what_it_names(page: Page) -> None:
    new, old = two_exports()
    page.goto("/")
    for side, mesh in (("source", new), ("reference", old)):
        drop(page, f".slot[data-slot={side}]", {mesh.name: mesh.data, **mesh.resources})

    page.get_by_role("button", name=f"Leave out {old.name} as the reference").click()

    expect(page.locator(".slot.filled")).to_have_count(1)
    expect(page.locator("[data-resources=reference] li")).to_have_count(0)
    expect(page.locator("[data-resources=source] li")).to_have_count(1)
    expect(page.locator("#send")).to_have_text("Audit the source alone")
