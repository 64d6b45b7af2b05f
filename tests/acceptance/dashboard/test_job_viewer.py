"""The meshes on the page of one job: drawn, coloured, compared, measured."""

from __future__ import annotations

import re

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Page, expect

from meshcone.files import MeshFile
from service.api.schemas import Job
from service.client import Client
from tests.acceptance.dashboard.browsing import difference, keep_picture, pixels, settle

DRAWN = 4.0  # mean difference of the pixels, of 255, that no antialiasing makes


def test_input_refined_and_reference_are_drawn_and_input_is_unlike_refined(
    job_page: Page,
) -> None:
    job_page.get_by_role("button", name="Shape", exact=True).click()
    job_page.get_by_role("button", name="Pins").click()
    settle(job_page)
    panes = np.array_split(pixels(job_page.locator(".view canvas")), 3, axis=1)
    # Without what lies over the canvas: names above, buttons on the right, axes below on the left.
    left, middle, right = (pane[60:, 70:-60] for pane in panes)

    for pane in (left, middle, right):
        assert pane.std() > DRAWN
    assert difference(left, middle) > DRAWN
    assert difference(middle, right) < difference(left, middle) / 2


def test_the_heat_map_comes_and_goes_with_its_legend_in_model_units(
    job_page: Page, refined: Job, client: Client
) -> None:
    canvas = job_page.locator(".view canvas")
    scale = job_page.get_by_test_id("scale")
    expect(scale).to_be_visible()
    radius = client.report(refined.id)["frame"]["radius"]
    marked = job_page.get_by_test_id("threshold").inner_text()
    assert float(marked.removeprefix("threshold ")) == pytest.approx(0.05 * radius, rel=0.01)
    heat = pixels(canvas)
    keep_picture(job_page, "job", height=950)

    job_page.get_by_role("button", name="Shape", exact=True).click()
    settle(job_page)
    expect(scale).to_be_hidden()
    shape = pixels(canvas)
    job_page.get_by_role("button", name="Deviation", exact=True).click()
    settle(job_page)

    assert difference(heat, shape) > DRAWN
    assert difference(heat, pixels(canvas)) < 1.0


def test_a_lower_threshold_puts_more_of_the_mesh_above_it(job_page: Page) -> None:
    canvas = job_page.locator(".view canvas")
    before = pixels(canvas)
    job_page.get_by_label("Threshold").fill("0.00001")
    job_page.get_by_label("Threshold").press("Enter")
    settle(job_page)

    assert reddish(pixels(canvas)) > reddish(before) + 0.05


def test_the_focus_stays_on_what_changes_the_scale(job_page: Page) -> None:
    threshold = job_page.get_by_label("Threshold")
    threshold.fill("0.01")
    threshold.press("Enter")
    expect(job_page.get_by_test_id("threshold")).to_contain_text("0.01")
    expect(threshold).to_be_focused()

    top = job_page.get_by_label("Scale", exact=True)
    top.focus()
    top.press("ArrowDown")
    expect(top).to_have_value("1")
    expect(top).to_be_focused()


def test_the_legend_names_the_mesh_whose_values_its_bars_are(job_page: Page) -> None:
    expect(job_page.locator(".legend-title")).to_contain_text("bars: refined mesh")


def test_choosing_a_worst_place_flies_there(job_page: Page) -> None:
    canvas = job_page.locator(".view canvas")
    before = pixels(canvas)
    second = job_page.get_by_role("button", name=re.compile("^2 on the"))
    second.click()
    settle(job_page)

    expect(second).to_have_attribute("aria-pressed", "true")
    assert difference(before, pixels(canvas)) > DRAWN


def test_the_slider_wipes_from_input_to_refined(job_page: Page) -> None:
    canvas = job_page.locator(".view canvas")
    job_page.get_by_role("button", name="Wipe", exact=True).click()
    job_page.get_by_role("button", name="Wireframe").click()
    slider = job_page.get_by_label("Wipe between the meshes")
    settle(job_page)
    keep_picture(job_page, "wipe", height=950)
    slider.press("End")
    settle(job_page)
    whole_input = pixels(canvas)
    slider.press("Home")
    settle(job_page)

    assert difference(whole_input, pixels(canvas)) > DRAWN


def test_fewer_triangles_stand_for_a_surface_in_its_place(job_page: Page) -> None:
    side, most = 200, 2_000
    u, v = np.meshgrid(np.arange(side + 1), np.arange(side + 1), indexing="ij")
    points = np.stack([u / side, v / side, 0.1 * np.sin(u / 20)], axis=-1).reshape(-1, 3)
    number = np.arange((side + 1) ** 2).reshape(side + 1, side + 1)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    index = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]).reshape(-1, 3)

    fewer = job_page.evaluate(
        "([position, index, most]) => import('meshcone/coarse').then(({ coarser }) => {"
        " const { faces, corners } = coarser({ position, index }, most);"
        " return { faces: [...faces], corners: [...corners] }; })",
        [points.ravel().tolist(), index.ravel().tolist(), most],
    )

    faces, corners = np.array(fewer["faces"]), np.array(fewer["corners"]).reshape(-1, 3)
    assert most / 2 < len(faces) == len(corners) < 1.5 * most
    moved = np.linalg.norm(points[corners] - points[index[faces]], axis=-1)
    one, two, three = points[index].transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(two - one, three - one), axis=1)
    cell = np.sqrt(3 * area.sum() / 2 / most)
    assert moved.max() <= np.sqrt(3) * cell
    flat = points[corners] * [1, 1, 0]
    drawn = np.cross(flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0])[:, 2]
    assert 0.5 * np.abs(drawn).sum() > 0.9  # of the square that the surface stands over


def test_the_keyboard_turns_all_meshes_together(job_page: Page) -> None:
    canvas = job_page.locator(".view canvas")
    before = np.array_split(pixels(canvas), 3, axis=1)
    canvas.focus()
    for _ in range(4):
        canvas.press("ArrowRight")
    settle(job_page)
    after = np.array_split(pixels(canvas), 3, axis=1)

    assert all(difference(one, other) > 1.0 for one, other in zip(before, after, strict=True))


def test_a_link_opens_the_same_view(job_page: Page) -> None:
    canvas = job_page.locator(".view canvas")
    job_page.get_by_role("button", name="Wipe", exact=True).click()
    job_page.get_by_label("Which meshes").select_option(label="Refined | Reference")
    job_page.get_by_role("button", name="Shape", exact=True).click()
    canvas.press("ArrowRight")
    canvas.press("+")
    job_page.wait_for_url(
        re.compile("(?=.*view=wipe:refined,reference)(?=.*colour=shape)(?=.*camera=0,0,0,3.06,)")
    )
    canvas.blur()
    before = pixels(canvas)

    job_page.reload()
    job_page.wait_for_selector("[data-ready]")
    settle(job_page)

    expect(job_page.get_by_role("button", name="Wipe", exact=True)).to_have_attribute(
        "aria-pressed", "true"
    )
    assert difference(before, pixels(canvas)) < 1.0


def test_two_meshes_blink_or_lie_over_each_other(job_page: Page) -> None:
    labels = job_page.locator(".pane-label")
    job_page.get_by_role("button", name="Blink", exact=True).click()
    expect(labels).to_have_text([re.compile("^Source")])
    job_page.get_by_role("button", name="Show the other").click()
    expect(labels).to_have_text([re.compile("^Refined")])

    job_page.get_by_role("button", name="Overlay", exact=True).click()
    expect(labels).to_have_text("Source under Refined")
    settle(job_page)
    both = pixels(job_page.locator(".view canvas"))
    job_page.get_by_role("button", name="One", exact=True).click()
    expect(labels).to_have_text([re.compile("^Refined")])
    settle(job_page)

    assert difference(both, pixels(job_page.locator(".view canvas"))) > 1.0


def test_a_pin_names_what_was_found_and_flies_there(job_page: Page) -> None:
    canvas = job_page.locator(".view canvas")
    before = pixels(canvas)
    pins = job_page.get_by_test_id("pins").get_by_role("button")
    pins.get_by_text("farthest, proven").first.locator("..").dispatch_event("click")
    settle(job_page)

    expect(
        job_page.get_by_role("button", name=re.compile("^1 farthest, proven"))
    ).to_have_attribute("aria-pressed", "true")
    assert difference(before, pixels(canvas)) > DRAWN


def test_the_view_is_saved_as_a_picture_with_its_scale(job_page: Page) -> None:
    box = job_page.locator(".view canvas").bounding_box()
    assert box is not None
    with job_page.expect_download() as downloading:
        job_page.get_by_role("button", name="Save a picture").click()

    assert downloading.value.suggested_filename == "jug_scan.view.png"
    picture = Image.open(downloading.value.path()).convert("RGB")
    fineness = picture.width / box["width"]
    assert fineness >= 1
    height = int(fineness * box["height"])
    assert picture.height > height + 40
    drawn = np.asarray(picture, dtype=float)
    assert drawn[:height].std() > DRAWN
    assert drawn[height:].std() > DRAWN


def test_a_measurement_shows_the_mesh_beside_its_reference(
    page: Page, client: Client, rough_ball: MeshFile, ball: MeshFile
) -> None:
    job = client.wait(client.submit(rough_ball, ball, {"mode": "measure"}).id)
    page.goto(f"/jobs/{job.id}")
    page.wait_for_selector("[data-ready]")

    expect(page.locator(".pane-label")).to_have_count(2)
    expect(page.get_by_test_id("verdict")).to_contain_text("units from its reference")
    expect(page.get_by_role("tab", name="Solver")).to_have_count(0)
    measured = measure_on_the_reference(page, away=60)
    radius = client.report(job.id)["frame"]["radius"]
    height = pixels(page.locator(".view canvas")).shape[0]
    # Facets lie a little inside the ball.
    assert measured == pytest.approx(radius * chord_on_a_ball(60, height), rel=0.03)


def measure_on_the_reference(page: Page, away: float) -> float:
    """Measure from the middle of the view to some pixels beside it."""
    page.get_by_role("button", name="One", exact=True).click()
    page.get_by_label("Which meshes").select_option(label="Reference")
    page.get_by_role("button", name="Pins").click()
    page.get_by_role("button", name="Measure between two points").click()
    settle(page)
    canvas = page.locator(".view canvas")
    box = canvas.bounding_box()
    assert box is not None
    middle = {"x": box["width"] / 2, "y": box["height"] / 2}
    canvas.click(position=middle)
    canvas.click(position={"x": middle["x"] + away, "y": middle["y"]})
    expect(page.get_by_test_id("measured")).to_contain_text("units apart")
    return float(page.get_by_test_id("measured").inner_text().split()[0])


def chord_on_a_ball(away: float, height: float) -> float:
    """Distance between the points of a unit ball that two pixels show.

    The eye is 3.6 from the ball's middle, with a field of 35 degrees over the height of the view;
    the second pixel is ``away`` to the right of the first, which shows the nearest point.
    """
    slope = 2 * np.tan(np.radians(35 / 2)) * away / height
    # |(0, 0, 3.6) + t (slope, 0, -1)| = 1, the nearer of the two.
    a, b, c = slope**2 + 1, -2 * 3.6, 3.6**2 - 1
    t = (-b - np.sqrt(b**2 - 4 * a * c)) / (2 * a)
    return float(np.hypot(t * slope, 3.6 - t - 1))


def reddish(image: np.ndarray) -> float:
    """Share of the pixels in the colours above the threshold."""
    red, green, blue = np.moveaxis(image, 2, 0)
    return float(((red > 1.5 * green) & (red > 1.2 * blue) & (red > 100)).mean())
