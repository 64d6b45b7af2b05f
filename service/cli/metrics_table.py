"""The metrics of a report as a table for a terminal."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.table import Table

ROUNDING = 1e-12  # of distances that are zero

_COLOURS = "appearance.color_difference"

_Value = float | bool | None


def metrics_table(report: Mapping[str, Any]) -> Table:
    """One row for each metric, under the name gates use for it.

    The columns are the input, the refined mesh and the baselines as far as the report has
    them, and the floor; then how the refined mesh compares with the input, or the unit.
    """
    from rich import box
    from rich.table import Table

    quality = report["quality"]
    sections = _sections(report)
    refined = sections.get("refined")
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    table.add_column("metric", no_wrap=True, min_width=max(map(len, sections["input"])))
    for heading in sections:
        table.add_column(heading.replace("_", " "), justify="right")
    # With baselines there is no room for the unit in the 80 columns of a log.
    with_unit = refined is None and "laplacian" not in sections
    if refined or with_unit:
        table.add_column("refined / input" if refined else "unit", justify="right")
    judged = "refined" if refined else "input"
    for name, most in _proven(report):
        shown = {judged: most, "floor": "0"}  # of the reference from itself
        cells = [shown.get(each, "") for each in sections]
        cells += ["" if refined else "radius"] if refined or with_unit else []
        table.add_row(name, *cells)
    for name, before in sections["input"].items():
        values = [section.get(name) for section in sections.values()]
        if all(value is None for value in values) and name == _FLIPPED:
            continue
        cells = [
            written(name, value) if name in section else ""
            for section, value in zip(sections.values(), values, strict=True)
        ]
        cells += [_ratio(refined[name], before)] if refined else []
        cells += [_unit(quality, name)] if with_unit else []
        table.add_row(name, *cells)
    return table


_FLIPPED = "validity.flipped_faces"


def _proven(report: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """What no point of the mesh, of the reference or of both exceeds, by the names of gates."""
    from meshcone.report.statement import rounded_up

    for name, interval in (report.get("deviation") or {}).items():
        if interval is not None and name != "area_beyond":  # a share, which no column fits
            yield f"deviation.{name}.upper", rounded_up(interval["upper"])


def _sections(report: Mapping[str, Any]) -> dict[str, dict[str, _Value]]:
    quality = report["quality"]
    named = {"input": quality["input"], "refined": quality.get("refined")}
    named |= quality.get("baselines") or {}
    named["floor"] = quality["floor"]
    found = {name: dict(leaves(metrics)) for name, metrics in named.items() if metrics}
    # The baselines move vertices only, which nobody asks the colours of.
    compared = dict(report.get("appearance") or {})
    compared["refined"] = compared.get("color_difference")
    for name in ("input", "refined", "floor"):
        if name in found and compared.get(name) is not None:
            found[name] |= _colours(compared[name])
    return found


def _colours(compared: Mapping[str, _Value] | str) -> dict[str, _Value]:
    if isinstance(compared, str):
        return {_COLOURS: None}
    return dict(leaves(compared, f"{_COLOURS}."))


def leaves(metrics: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, _Value]]:
    """Every number, yes or no and gap of a section by its dotted name; places are left out."""
    for name, value in metrics.items():
        if isinstance(value, Mapping):
            yield from leaves(value, f"{prefix}{name}.")
        elif value is None or isinstance(value, int | float):
            yield prefix + name, value


def written(name: str, value: _Value) -> str:
    """Write a value as people read it."""
    if value is None:
        return "-" if name == _FLIPPED else "not tested"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}"
    return "0" if abs(value) < ROUNDING else f"{value:.3g}"


def _ratio(after: _Value, before: _Value) -> str:
    if not isinstance(after, float) or not isinstance(before, float) or before <= ROUNDING:
        return "-"
    return f"{after / before:.3f}"


def _unit(quality: Mapping[str, Any], name: str) -> str:
    if name == f"{_COLOURS}.psnr":
        return "dB"
    metric = name.removeprefix("appearance.").partition(".")[0]
    unit: str = quality["conventions"]["metrics"][metric]["unit"]
    return "" if unit in ("1", "count") else unit
