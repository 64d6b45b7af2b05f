"""What is printed where a tolerance was not reached, or a gate was not passed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from meshcone.gates.words import label, number, point
from meshcone.options import WITHIN_GATE

MISSED_SECTIONS = ("within", "gates", "outcome")
_PLACES = 5


@dataclass(frozen=True)
class Missed:
    """What a result falls short of.

    Attributes:
        lines: that a tolerance was not reached, why and where; and each gate that was not passed.
        failed: whether the command has to fail for it: gates can warn alone.
    """

    lines: tuple[str, ...]
    failed: bool


def missed(report: Mapping[str, Any]) -> Missed:
    """What a result falls short of; nothing where nothing was asked for.

    Args:
        report: as JSON; of a refinement the sections named above are enough.
    """
    gates = report.get("gates") or {"verdict": "pass", "checks": []}
    tolerance = list(_tolerance_lines(report, gates["checks"]))
    told = {WITHIN_GATE} if tolerance else set()
    lines = [
        f"{label(check['status'], check['severity']):<15}{check['words']}"
        for check in gates["checks"]
        if check["status"] != "pass" and check["key"] not in told
    ]
    return Missed((*tolerance, *lines), bool(tolerance) or gates["verdict"] != "pass")


def _tolerance_lines(
    report: Mapping[str, Any], checks: Iterable[Mapping[str, Any]]
) -> Iterator[str]:
    within: Mapping[str, Any] | None = report.get("within")
    if within is None or within["reached"]:
        return
    tries = f"{within['attempts']} refinement{'s' if within['attempts'] > 1 else ''}"
    what = f"after {tries}; the closest of them was written"
    if report.get("outcome") == "misaligned":
        what = "as source and reference do not fit: nothing was refined, and the input was written"
    yield f"not within {within['asked']}, {what}"
    for check in checks:
        if check["key"] == WITHIN_GATE:
            yield f"reason         {check['words']}"
    for place in within["places"][:_PLACES]:
        distance = number(place["distance_model"])
        yield f"place          {distance} {within['unit']} off near {point(place['position'])}"
