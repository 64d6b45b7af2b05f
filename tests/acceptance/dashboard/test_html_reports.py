"""Reports as one HTML file, opened without a network."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect

from meshcone.files import MeshFile
from tests.acceptance.dashboard.barriers import barriers
from tests.acceptance.dashboard.browsing import difference, open_tab, pixels, warm, watched_page
from tests.commands import meshcone
from tests.painted import encoded, painted, picture
from tests.truck import truck_obj


@pytest.fixture
def folder(tmp_path: Path, rough_ball: MeshFile, ball: MeshFile) -> Path:
    for file in (rough_ball, ball):
        (tmp_path / file.name).write_bytes(file.data)
    return tmp_path


@pytest.fixture
def offline(browser: Browser) -> Iterator[Page]:
    """A page without a network, from a file."""
    with watched_page(browser, "file://") as (page, faults):
        page.context.set_offline(True)
        yield page
    assert faults.said == []
    assert faults.elsewhere == []


def test_a_refinement_leaves_a_page_that_needs_nothing_else(folder: Path, offline: Page) -> None:
    done = meshcone(folder, "refine", "rough.obj", "ball.obj", "-o", "out.obj", "--html", "r.html")
    assert done.returncode == 0, done.stderr

    offline.goto((folder / "r.html").as_uri())
    offline.wait_for_selector("[data-ready]")
    view = offline.get_by_test_id("view").locator("canvas")
    heat = pixels(view)
    offline.get_by_role("button", name="Shape", exact=True).click()
    expect(offline.get_by_test_id("scale")).to_be_hidden()

    assert difference(heat, pixels(view)) > 4
    expect(offline.get_by_test_id("verdict")).to_contain_text("closer to its reference")
    open_tab(offline, "Solver")
    expect(offline.get_by_role("heading", name="Certificate")).to_be_visible()


def test_coloured_assets_are_pictured_from_six_sides(tmp_path: Path, offline: Page) -> None:
    (tmp_path / "globe.gltf").write_bytes(painted(encoded(picture())))
    (tmp_path / "white.gltf").write_bytes(painted())
    gate = '[gates]\n"appearance.color_difference.p95" = { max = 10 }\n'
    (tmp_path / "gates.toml").write_text(gate)
    done = meshcone(
        tmp_path,
        *("gate", "white.gltf", "globe.gltf", "--gates", "gates.toml", "--html", "g.html"),
    )
    assert done.returncode == 1, done.stderr

    offline.goto((tmp_path / "g.html").as_uri())
    offline.wait_for_selector("[data-ready]")

    view = offline.get_by_test_id("view").locator("canvas")
    offline.get_by_role("button", name="Textures").click()
    expect(offline.get_by_test_id("scale")).to_be_hidden()
    white, globe = np.array_split(pixels(view), 2, axis=1)
    offline.get_by_role("button", name="UV").click()
    offline.wait_for_url(re.compile("colour=uv"))
    assert difference(white, globe) > 10
    assert difference(globe, np.array_split(pixels(view), 2, axis=1)[1]) > 10
    offline.get_by_role("button", name="Colour difference").click()
    scale = offline.get_by_test_id("scale")
    expect(scale).to_be_visible()
    expect(offline.get_by_test_id("threshold")).to_have_text("threshold 10")
    beyond, shown = np.array_split(pixels(view), 2, axis=1)
    assert warm(beyond) > 0.2  # most of a white globe is farther from its colours than is allowed
    offline.get_by_role("button", name="Deviation").click()
    plain = np.array_split(pixels(view), 2, axis=1)[1]
    assert difference(shown, plain) > 10  # the reference keeps its own
    image = offline.get_by_test_id("pictures")
    expect(image).to_have_js_property("naturalWidth", 1044)
    expect(offline.locator('[data-metric="appearance.color_difference.p95"]')).to_contain_text(
        "max 10"
    )
    expect(offline.get_by_test_id("verdict")).to_contain_text("colour difference (CIEDE2000)")


def test_a_missing_wheel_stands_first_among_the_parts(tmp_path: Path, offline: Page) -> None:
    (tmp_path / "truck.obj").write_bytes(truck_obj(without=["wheel_front_left"]))
    (tmp_path / "master.obj").write_bytes(truck_obj())
    (tmp_path / "gates.toml").write_text('[gates]\n"warnings.pieces.missing" = { max = 0 }\n')
    done = meshcone(
        tmp_path,
        *("gate", "truck.obj", "master.obj", "--gates", "gates.toml", "--per", "node"),
        *("--html", "g.html"),
    )
    assert done.returncode == 1, done.stderr
    assert "allowed 0: pieces.missing: wheel_front_left: missing." in done.stdout

    offline.goto((tmp_path / "g.html").as_uri())
    offline.wait_for_selector("[data-ready]")

    first = offline.get_by_test_id("directions").locator("[data-part]").first
    expect(first).to_contain_text("wheel_front_left")
    expect(first.locator(".chip")).to_have_text("missing")
    open_tab(offline, "Changes")
    view = offline.get_by_test_id("view").locator("canvas")
    offline.get_by_role("button", name="Pins").click()
    offline.get_by_role("button", name="Show wheel_front_left alone").click()
    offline.wait_for_url(re.compile("camera=(?!0,0,0,3.6)"))
    alone, wheel = np.array_split(pixels(view), 2, axis=1)
    beside_labels = np.s_[60:-70, 100:-60]
    # The source has no such wheel.
    assert wheel[beside_labels].std() > 5 * alone[beside_labels].std()
    expect(offline.locator("[aria-labelledby=warnings-title]")).to_contain_text("pieces.missing")


def test_a_gate_run_leaves_a_page_of_all_assets_the_bad_ones_first(
    folder: Path, offline: Page
) -> None:
    (folder / "gates.toml").write_text('[gates]\n"point_to_surface.max" = { max = 0.001 }\n')
    (folder / "broken.obj").write_text("v nan 0 0\n")
    (folder / "pairs.csv").write_text(
        "source,reference,name\nball.obj,ball.obj,</script><b>ball\n"
        "rough.obj,ball.obj,\nbroken.obj,ball.obj,\n"
    )
    done = meshcone(
        folder, "gate", "--manifest", "pairs.csv", "--gates", "gates.toml", "--html", "g.html"
    )
    assert done.returncode == 2, done.stderr

    offline.goto((folder / "g.html").as_uri())
    rows = offline.locator("tbody tr")
    expect(rows).to_have_count(3)
    expect(rows.nth(0)).to_contain_text("broken.obj")
    expect(rows.nth(1)).to_contain_text("worst deviation")
    expect(rows.nth(2)).to_contain_text("</script><b>ball")
    offline.get_by_role("link", name="rough.obj").click()
    offline.wait_for_selector("[data-ready]")
    expect(offline.get_by_test_id("verdict")).to_contain_text("Failed: 1 of 1 check.")
    expect(offline.get_by_test_id("verdict")).to_contain_text(re.compile(r"\d . allowed"))
    offline.get_by_test_id("verdict").get_by_role("button", name="Show where").click()
    expect(offline.locator(".places button[aria-pressed=true]")).to_have_count(1)
    offline.get_by_role("link", name="all assets").click()
    expect(rows).to_have_count(3)


def test_an_asset_audited_by_itself_is_not_said_to_lack_meshes(folder: Path, offline: Page) -> None:
    (folder / "gates.toml").write_text('[gates]\n"asset.budget.triangles" = { max = 3 }\n')
    done = meshcone(folder, "gate", "ball.obj", "--gates", "gates.toml", "--html", "g.html")
    assert done.returncode == 1, done.stderr

    offline.goto((folder / "g.html").as_uri())

    expect(offline.get_by_test_id("verdict")).to_contain_text("Failed: 1 of 1 check.")
    expect(offline.locator("#report")).not_to_contain_text("not in this file")


def test_a_report_has_no_serious_barrier_in_light_or_dark(
    tmp_path: Path, browser: Browser, rough_ball: MeshFile, ball: MeshFile
) -> None:
    for file in (rough_ball, ball):
        (tmp_path / file.name).write_bytes(file.data)
    (tmp_path / "gates.toml").write_text('[gates]\n"point_to_surface.max" = { max = 0.001 }\n')
    done = meshcone(
        tmp_path, "gate", "rough.obj", "ball.obj", "--gates", "gates.toml", "--html", "g.html"
    )
    assert done.returncode == 1, done.stderr

    found = []
    with watched_page(browser, "file://") as (page, _):
        page.context.set_offline(True)
        page.goto((tmp_path / "g.html").as_uri())
        page.wait_for_selector("[data-ready]")
        for tab in ("Changes", "Metrics", "Audit"):
            open_tab(page, tab)
            found += barriers(page, "[role=tabpanel]:not([hidden])")
        for scheme in ("light", "dark"):
            page.emulate_media(color_scheme=scheme, reduced_motion="reduce")
            found += [f"{scheme}: {each}" for each in barriers(page)]

    assert found == []
