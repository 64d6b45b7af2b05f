"""The documentation as a site: what its navigation has, and what it would load from elsewhere."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "zensical.toml").read_text())["project"]
# The site's own build checks links between its pages, and nothing that lies beside them.
DOCUMENTS = [*ROOT.glob("*.md"), *sorted(ROOT.glob("docs/*.md")), ROOT / "examples" / "README.md"]
LINK = re.compile(r"\]\(<?([^)\s>]+)")
KINDS = ["Home", "Tutorials", "How-to", "Explanation", "Reference"]


def pages(entries: list[dict[str, Any]]) -> Iterator[str]:
    for entry in entries:
        for value in entry.values():
            if isinstance(value, str):
                yield value
            else:
                yield from pages(value)


def test_the_site_has_every_page_once() -> None:
    found = sorted(path.relative_to(ROOT / "docs") for path in (ROOT / "docs").rglob("*.md"))

    assert sorted(pages(PROJECT["nav"])) == [path.as_posix() for path in found]


def test_the_pages_are_of_four_kinds() -> None:
    assert [name for entry in PROJECT["nav"] for name in entry] == KINDS


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: path.name)
def test_links_to_files_of_the_repository_lead_to_one(document: Path) -> None:
    named = [target.partition("#")[0] for target in LINK.findall(document.read_text())]
    files = [
        name for name in named if name and "://" not in name and not name.startswith("mailto:")
    ]

    assert [name for name in files if not (document.parent / name).exists()] == []


@pytest.mark.parametrize("page", sorted(ROOT.glob("docs/*.md")), ids=lambda path: path.name)
def test_a_page_links_to_nothing_that_the_site_does_not_have(page: Path) -> None:
    """What lies beside the documentation is not served with it."""
    assert [target for target in LINK.findall(page.read_text()) if target.startswith("..")] == []


def test_the_site_loads_no_font_from_elsewhere() -> None:
    assert PROJECT["theme"]["font"] is False
