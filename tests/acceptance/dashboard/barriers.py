"""What axe-core finds on a page."""

from __future__ import annotations

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Page

SERIOUS = {"serious", "critical"}
RULES = {"resultTypes": ["violations"]}
AXE = Axe().axe_script


def barriers(page: Page, part: str | None = None) -> list[str]:
    """What axe finds serious or worse in a part of the page."""
    page.evaluate(f"if (!globalThis.axe) {{ {AXE} }}")
    found = page.evaluate("([part, options]) => axe.run(part ?? document, options)", [part, RULES])
    return [
        f"{each['id']} at {node['html'][:160]}"
        for each in found["violations"]
        if each["impact"] in SERIOUS
        for node in each["nodes"]
    ]
