"""The lines printed for a tolerance that was not reached."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from meshcone.gates.words import number, point
from meshcone.options import WITHIN_GATE

MISSED_SECTIONS = ("within", "gates")
_PLACES = 5


def missed_lines(report: Mapping[str, Any]) -> list[str]:
    """That a tolerance was not reached, why and where; nothing where it was, or none was asked for.

    Args:
        report: of a refinement, as JSON; the sections named above are enough.
    """
    within = report.get("within")
    if within is None or within["reached"]:
        return []
    tries = f"{within['attempts']} refinement{'s' if within['attempts'] > 1 else ''}"
    lines = [f"not within {within['asked']}, after {tries}; the closest of them was written"]
    lines += [
        f"reason         {check['words']}"
        for check in report["gates"]["checks"]
        if check["key"] == WITHIN_GATE
    ]
    for place in within["places"][:_PLACES]:
        distance = number(place["distance_model"])
        lines.append(
            f"place          {distance} {within['unit']} off near {point(place['position'])}"
        )
    return lines
