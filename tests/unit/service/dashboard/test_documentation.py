"""The documentation under /help, as a site that was built into the pages."""

from __future__ import annotations

import base64
import hashlib
from pathlib import Path

import pytest

from service.dashboard.documentation import BUILT, Documentation, documentation_router
from service.dashboard.pages import page
from service.problems import ProblemError

SCRIPT = "document.title += '!'"
STYLE = "." + "a{color:red}" * 100


@pytest.fixture
def documentation(tmp_path: Path) -> Documentation:
    site = tmp_path / "site"
    (site / "gates").mkdir(parents=True)
    (site / "index.html").write_text(f"<script>{SCRIPT}</script>home")
    (site / "gates" / "index.html").write_text("gates")
    (site / "search.js").write_text(f"let a;var b='{STYLE}';a")
    (tmp_path / "secret.html").write_text("secret")
    return Documentation(site)


def digest(text: str) -> str:
    return base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()


@pytest.mark.parametrize(
    ("path", "body"),
    [("", b"</script>home"), ("gates/", b"gates"), ("gates/index.html", b"gates")],
)
def test_a_folder_stands_for_the_page_in_it(
    documentation: Documentation, path: str, body: bytes
) -> None:
    answer = documentation.answer(path)

    assert answer.body.endswith(body)
    assert answer.headers["content-type"] == "text/html; charset=utf-8"


def test_a_folder_without_its_slash_is_sent_there(documentation: Documentation) -> None:
    assert documentation.answer("gates").headers["location"] == "/help/gates/"


def test_a_page_may_run_the_scripts_that_are_in_it_and_no_others(
    documentation: Documentation,
) -> None:
    home, gates = (documentation.answer(each).headers for each in ("", "gates/"))

    assert f"script-src 'self' 'sha256-{digest(SCRIPT)}';" in home["content-security-policy"]
    assert "script-src 'self';" in gates["content-security-policy"]
    assert "unsafe" not in home["content-security-policy"]


def test_the_search_may_have_the_style_sheet_that_its_script_brings(
    documentation: Documentation,
) -> None:
    policy = documentation.answer("").headers["content-security-policy"]

    assert f"style-src 'self' 'sha256-{digest(STYLE)}';" in policy


@pytest.mark.parametrize(
    "path", ["../secret.html", "%2e%2e/secret.html", "nowhere", "/etc/passwd", "gates//"]
)
def test_nothing_outside_of_the_site_is_sent(documentation: Documentation, path: str) -> None:
    with pytest.raises(ProblemError) as refused:
        documentation.answer(path)

    assert refused.value.problem.status == 404


def test_where_no_site_was_built_there_is_no_help(tmp_path: Path) -> None:
    assert documentation_router(Documentation(tmp_path)).routes == []


def test_the_pages_lead_to_the_help_where_there_is_one() -> None:
    assert ('href="/help/"' in page("jobs").html) == bool(Documentation(BUILT))
