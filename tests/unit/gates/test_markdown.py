"""The summary in Markdown, as another parser reads it."""

from __future__ import annotations

import re

import pytest
from markdown_it import MarkdownIt
from markdown_it.token import Token

from meshcone.gates.formats.markdown import MOST_ASSETS, MOST_CHARACTERS, to_markdown
from meshcone.gates.records import GateCheck
from meshcone.gates.results import GateRun
from tests.unit.gates.runs import MIXED, OPPOSED, asset, broken, check, warned

HOSTILE = [
    "a|b.obj",
    "a`b``c.obj",
    "\\|.obj",
    "[x](http://evil.example)",
    "<script>alert(1)</script>",
    "</code></td>",
    "![x](y)",
    "&lt;b&gt;",
    "*a* _b_ ~~c~~",
    "line\nbreak | cell",
    "www.evil.example",
    "https://evil.example/",
    "\u202egnp.obj",
    "a\u00a0b.obj",
    "$x$ :smile: #1",
]


def tokens(data: bytes) -> list[Token]:
    return MarkdownIt("gfm-like", {"linkify": False}).parse(data.decode())


def rows(data: bytes) -> list[list[str]]:
    """The cells of the table, as they are shown."""
    shown: list[list[str]] = []
    for before, token in zip([None, *tokens(data)], tokens(data), strict=False):
        if token.type == "tr_open":
            shown.append([])
        elif before is not None and before.type in ("td_open", "th_open"):
            children = token.children or ()
            shown[-1].append("".join(each.content for each in children if each.type == "text"))
    return shown[1:]


def far(name: str, value: float, limit: float, bound: str = "max") -> GateCheck:
    found = {"value": value, "limit": limit, "bound": bound, "words": f"{name} is {value}"}
    return check("fail", key=name).model_copy(update=found)


def test_the_worst_assets_come_first() -> None:
    run = GateRun.of(
        [
            asset("good.obj", check("pass")),
            asset("a little.obj", far("emd", 0.55, 0.5)),
            asset("far.obj", far("emd", 1.5, 0.5)),
            asset("low.obj", far("fscore", 0.1, 0.5, "min")),
            broken("cut.glb", "input", "cut.glb: the file ends too early"),
        ]
    )

    shown = [row[1] for row in rows(to_markdown(run))]

    assert shown == ["cut.glb", "far.obj", "low.obj", "a little.obj", "good.obj"]


def test_a_row_says_what_failed_and_by_how_much() -> None:
    [row] = rows(to_markdown(GateRun.of([asset("far.obj", far("emd", 1.5, 0.5), check("pass"))])))

    assert row == ["❌ FAILED", "far.obj", "1 of 2", "emd is 1.5", "200 %"]


@pytest.mark.parametrize(
    ("value", "over"), [(0.505, "1 %"), (0.9, "80 %"), (5.7, "1,040 %"), (1e12, "2e+14 %")]
)
def test_an_excess_is_written_with_its_digits(value: float, over: str) -> None:
    [row] = rows(to_markdown(GateRun.of([asset("far.obj", far("emd", value, 0.5))])))

    assert row[-1] == over


def test_what_a_report_warns_of_stands_below() -> None:
    text = to_markdown(GateRun.of([warned("turned.obj", OPPOSED)])).decode()

    assert "- warning: normals.opposed&#58; Most normals" in text


def test_a_bound_of_zero_has_no_share_to_be_over() -> None:
    [row] = rows(to_markdown(GateRun.of([asset("a.obj", far("emd", 3, 0))])))

    assert row[3:] == ["emd is 3", ""]


def test_verdict_label_and_counts_stand_above() -> None:
    run = GateRun.of(MIXED.assets, "nightly")

    heading, counts = [each.content for each in tokens(to_markdown(run)) if each.type == "inline"][
        :2
    ]

    assert heading == "MeshCone gate: nightly: 💥 ERROR"
    assert counts == "6 assets: 2 💥 ERROR, 1 ❌ FAILED, 1 ❔ not tested, 2 ✅ pass"


def test_every_check_that_did_not_pass_stands_below() -> None:
    text = to_markdown(MIXED).decode()

    assert "- FAILED: emd fail &#60;&#38;&#62;" in text
    assert "- warning: chamfer fail" in text
    assert "- NOT TESTED: emd not_tested" in text


@pytest.mark.parametrize("name", HOSTILE)
def test_a_hostile_name_is_text_in_its_cell(name: str) -> None:
    run = GateRun.of([asset(name, check("fail").model_copy(update={"words": name}))])
    data = to_markdown(run)
    printable = name.replace("\n", "\ufffd").replace("\u202e", "\ufffd")

    [row] = rows(data)

    assert (row[1], row[3]) == (printable, printable)
    markup = {each.type for token in tokens(data) for each in token.children or ()}
    assert markup <= {"text", "html_inline", "softbreak", "text_special"}
    html = [
        each.content
        for token in tokens(data)
        for each in [token, *(token.children or ())]
        if each.type in ("html_inline", "html_block")
    ]
    allowed = r"(<code>|</code>|<details>|</details>|<summary>|</summary>)"
    assert all("<" not in re.sub(allowed, "", each) for each in html)


def test_nobody_is_notified_by_a_name() -> None:
    text = to_markdown(GateRun.of([asset("@somebody.obj", check("fail"))])).decode()

    assert "@" not in text
    assert "&#64;&#8203;somebody" in text


def test_it_fits_into_a_comment_however_many_fail() -> None:
    many = GateRun.of([asset(f"{number}.obj", check("fail")) for number in range(2_000)])
    data = to_markdown(many)

    assert len(data.decode()) < MOST_CHARACTERS + 200
    assert len(rows(data)) == MOST_ASSETS
    assert "and 1950 more" in data.decode()
    assert "stands in the JSON" in data.decode()


STATEMENT = "every point within 0.42 mm of the reference (proven)"


def test_what_is_proven_of_one_asset_comes_first() -> None:
    one = asset("good.obj", check("pass")).model_copy(update={"statement": STATEMENT})
    lines = to_markdown(GateRun.of([one])).decode().splitlines()
    assert lines[:3] == ["## MeshCone gate: \u2705 pass", "", STATEMENT]


def test_what_is_proven_of_several_stands_with_what_each_did_not_pass() -> None:
    bad = asset("bad.obj", check("fail")).model_copy(update={"statement": STATEMENT})
    shown = to_markdown(GateRun.of([bad, asset("good.obj", check("pass"))])).decode()
    assert shown.count(STATEMENT) == 1
    assert shown.index(STATEMENT) > shown.index("<details>")
