"""A summary in GitHub's Markdown, for a pull request or a job's page.

Names of files and words from them reach it as text: every character that could be markup is
written as an entity (CommonMark 0.31, section 2.5), so that none of them can link, mention
anybody, or end a cell.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from math import inf
from urllib.parse import quote

from meshcone.gates.records import GateCheck
from meshcone.gates.results import AssetResult, Ending, GateRun
from meshcone.gates.words import label
from meshcone.text import as_line

MOST_ASSETS = 50  # with a row each
MOST_CHECKS = 10  # of an asset, in words
MOST_CHARACTERS = 60_000  # a comment on GitHub has at most 65,536
_LONGEST = 300  # of a name or of words, in characters
_ORDER: tuple[Ending, ...] = ("error", "fail", "not_tested", "pass")
_SHOWN: Mapping[Ending, str] = {
    "error": "💥 ERROR",
    "fail": "❌ FAILED",
    "not_tested": "❔ not tested",
    "pass": "✅ pass",
}
# All but letters, digits and what is never markup within a line; addresses begin with "www.".
_MARKUP = re.compile(r"[^\w /.,+=()%-]|(?<![^\W_])_|_(?![^\W_])|(?<=[wW]{3})\.")


def to_markdown(run: GateRun, pictures: Mapping[str, str] | None = None) -> bytes:
    """Write a run as Markdown: the verdict, a table of the worst assets, what failed of each.

    Args:
        run: all assets.
        pictures: by the name of an asset, the path of its picture from where the summary is.
    """
    title = "MeshCone gate" if run.label is None else f"MeshCone gate: {_text(run.label)}"
    ends = ", ".join(f"{run.counts[each]} {_SHOWN[each]}" for each in _ORDER if run.counts[each])
    plural = "asset" if len(run.assets) == 1 else "assets"
    parts = [
        f"## {title}: {_SHOWN[run.verdict]}\n",
        *(f"\n{_text(each)}\n" for each in _only_statement(run)),
        f"\n{len(run.assets)} {plural}: {ends}\n",
        _table(sorted(run.assets, key=_badness)),
    ]
    length = sum(map(len, parts))
    for asset in sorted(run.assets, key=_badness):
        part = _details(asset, (pictures or {}).get(asset.name))
        if length + len(part) > MOST_CHARACTERS:
            parts.append("\nThere is more; it stands in the JSON, JUnit or SARIF file.\n")
            break
        parts.append(part)
        length += len(part)
    return "".join(parts).encode()


def _only_statement(run: GateRun) -> Iterator[str]:
    """What is proven of a run of one asset; of several it stands with each."""
    if len(run.assets) == 1 and run.assets[0].statement is not None:
        yield run.assets[0].statement


def _badness(asset: AssetResult) -> tuple[int, float]:
    """What sorts the worst first: how it ended, then how far out of bounds it is."""
    excess = max((_excess(check) or 0.0 for check in _open_or_failed(asset)), default=0.0)
    return _ORDER.index(asset.ending), -excess


def _table(assets: list[AssetResult]) -> str:
    rows = ["", "| verdict | asset | checks passed | worst | over by |", "|---|---|--:|---|--:|"]
    rows += [_row(asset) for asset in assets[:MOST_ASSETS]]
    left_out = len(assets) - MOST_ASSETS
    return "\n".join(rows) + "\n" + (f"\nand {left_out} more\n" if left_out > 0 else "")


def _row(asset: AssetResult) -> str:
    checks = asset.checks()
    passed = sum(check.status == "pass" for check in checks)
    worst = next(iter(_open_or_failed(asset)), None)
    words = "" if worst is None else _text(worst.words)
    if asset.error is not None:
        words = _text(asset.error.message)
    cells = (
        _SHOWN[asset.ending],
        _name(asset.name),
        f"{passed} of {len(checks)}" if checks else "",
        words,
        "" if worst is None else _over(worst),
    )
    return f"| {' | '.join(cells)} |"


def _details(asset: AssetResult, picture: str | None) -> str:
    """All that an asset did not pass, and what is suspicious of it; nothing if there is nothing."""
    bad = _open_or_failed(asset)
    lines = [f"- {label(each.status, each.severity)}: {_text(each.words)}" for each in bad]
    if len(bad) > MOST_CHECKS:
        lines[MOST_CHECKS:] = [f"- and {len(bad) - MOST_CHECKS} more"]
    lines += [f"- warning: {_text(words)}" for words in _warnings(asset)]
    if lines and asset.statement is not None:
        lines.insert(0, f"- proven: {_text(asset.statement)}")
    if picture is not None:
        lines += ["", f'<img alt="{_text(asset.name)}" src="{quote(picture)}">']
    if not lines:
        return ""
    shown = "\n".join(lines)
    heading = _name(asset.name)
    if asset.reference is not None:
        heading += f" against {_name(asset.reference)}"
    return f"\n<details><summary>{heading}</summary>\n\n{shown}\n\n</details>\n"


def _warnings(asset: AssetResult) -> Iterator[str]:
    yield from map(str, asset.warnings[:MOST_CHECKS])
    if len(asset.warnings) > MOST_CHECKS:
        yield f"and {len(asset.warnings) - MOST_CHECKS} more"


def _open_or_failed(asset: AssetResult) -> list[GateCheck]:
    """The checks that did not pass: errors before warnings, failures first, the farthest first."""
    bad = [check for check in asset.checks() if check.status != "pass"]
    return sorted(
        bad,
        key=lambda each: (each.severity, each.status != "fail", -(_excess(each) or 0.0)),
    )


def _excess(check: GateCheck) -> float | None:
    """By which share of its bound a number is out of bounds; None where that cannot be said."""
    value, limit = check.value, check.limit
    if (
        check.status != "fail"
        or limit is None
        or isinstance(value, bool | str | tuple)
        or value is None
    ):
        return None
    beyond = limit - value if check.bound.startswith("min") else value - limit
    return beyond / abs(limit) if limit else inf


def _over(check: GateCheck) -> str:
    excess = _excess(check)
    if excess is None or excess == inf:
        return ""
    percent = 100 * excess
    return f"{percent:,.0f} %" if 100 <= percent < 1e9 else f"{percent:.3g} %"


def _name(name: str) -> str:
    return f"<code>{_text(name)}</code>"


def _text(words: str) -> str:
    """Words as plain text: no markup, and no mention that would notify a person."""
    if len(words) > _LONGEST:
        words = words[:_LONGEST] + "…"
    line = as_line(words, "\N{REPLACEMENT CHARACTER}")
    escaped = _MARKUP.sub(lambda found: f"&#{ord(found[0])};", line)
    # GitHub looks for people's names in what the entities become.
    return escaped.replace("&#64;", "&#64;&#8203;")
