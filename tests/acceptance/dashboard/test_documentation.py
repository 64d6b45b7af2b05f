"""The documentation in a browser: read, searched, and nothing against its policy."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Page, expect

from service.dashboard.documentation import BUILT, Documentation


@pytest.fixture(autouse=True)
def built() -> None:
    if not Documentation(BUILT):
        pytest.skip("the documentation was not built; `make site` builds it")


def test_the_pages_lead_to_the_documentation(page: Page) -> None:
    page.goto("/")
    page.get_by_role("link", name="Help").click()

    expect(page).to_have_title("Home - MeshCone")
    expect(page.get_by_role("heading", level=1, name="MeshCone")).to_be_visible()


def test_the_documentation_is_searched_without_another_host(page: Page) -> None:
    page.goto("/help/gates/")
    page.get_by_role("button", name="Search").first.click()
    page.keyboard.type("watertight")

    expect(page.get_by_text(re.compile(r"^\d+ results$"))).to_be_visible()
