"""The page of a job that audited an asset by itself, without a reference or a preview."""

from __future__ import annotations

from playwright.sync_api import Page, expect

from meshcone.files import MeshFile
from service.client import Client
from service.stack import Stack
from tests.acceptance.dashboard.browsing import open_tab
from tests.whole_asset import whole


def test_an_audit_shows_verdict_gates_and_values(page: Page, stack: Stack, client: Client) -> None:
    options = {"mode": "audit", "gates": {"asset.budget.triangles": {"max": 3}}}
    source = MeshFile("asset.gltf", whole().to_bytes())
    job = client.wait(client.submit(source, None, options).id)

    page.goto(f"{stack.url}/jobs/{job.id}")

    expect(page.get_by_test_id("verdict")).to_contain_text("Failed: 1 of 1 check.")
    expect(page.get_by_test_id("verdict")).to_contain_text("asset.budget.triangles 4, allowed 3")
    open_tab(page, "Audit")
    page.get_by_test_id("audit").locator("summary", has_text="budget").click()
    expect(page.get_by_role("row", name="triangles 4")).to_be_visible()
    page.goto(stack.url)
    row = page.locator(f'tr[data-id="{job.id}"]')
    expect(row).to_contain_text("asset.gltf")
    expect(row).to_contain_text("audit")
