"""A result as a notebook shows it."""

from __future__ import annotations

from playwright.sync_api import Browser, expect

import meshcone
from meshcone.files import MeshFile
from tests.acceptance.dashboard.browsing import open_tab, watched_page


def test_a_result_is_shown_in_its_frame_without_a_network(
    browser: Browser, rough_ball: MeshFile, ball: MeshFile
) -> None:
    refined = meshcone.refine(rough_ball, ball, effort="fast")

    with watched_page(browser, "about:") as (page, faults):
        page.context.set_offline(True)
        page.set_content(f"<body><p>a cell</p>{refined._repr_html_()}</body>")
        frame = page.frame_locator("iframe")
        frame.locator("[data-ready]").wait_for()

        expect(frame.get_by_test_id("verdict")).to_contain_text("closer to its reference")
        open_tab(frame, "Solver")
        expect(frame.get_by_role("heading", name="Certificate")).to_be_visible()

    assert faults.said == []
    assert faults.elsewhere == []
