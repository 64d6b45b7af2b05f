"""Gates proposed from assets that somebody has accepted.

A number is bounded by the percentile of what the assets have, by the nearest-rank method, so that
every bound is the value of one asset. Which values are bounded, and from which side, are those that
the profiles bound and, of pairs, how far apart they are and what changed.
"""

from __future__ import annotations

import functools
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from meshcone.errors import InputError
from meshcone.gates.files import profile_gates
from meshcone.gates.paths import Known, find, known_values
from meshcone.gates.profile import PROFILES
from meshcone.gates.rules import Allowed
from meshcone.options import Mode
from meshcone.quality.deviation.records import DistanceInterval, ShareInterval
from meshcone.report.report import AnyReport
from meshcone.text import printable

PERCENTILE = 99.0

Side = Literal["max", "min", "equals"]

# Of a pair: how far apart, how alike in shading and colour. What bounds each best is its worst.
_PAIRS: Mapping[str, Side] = {
    "deviation.max": "max",
    "point_to_surface.mean": "max",
    "point_to_surface.p95": "max",
    "normal_deviation_deg": "max",
    "normal_consistency": "min",
    "appearance.color_difference.p95": "max",
}
_CHANGES = "changes."
_DIGITS = 3  # that a bound keeps of a fraction


@dataclass(frozen=True)
class Threshold:
    """A gate that the accepted assets propose.

    Attributes:
        key: the value it is about.
        side: the bound.
        bound: what is allowed; of a fraction, rounded away from the assets to three digits.
        asset: whose value the bound is; None where all have the same.
        beyond: assets that it would fail, where there are more than a percentile keeps.
        assets: how many have the value.
    """

    key: str
    side: Side
    bound: Allowed
    asset: str | None
    beyond: tuple[str, ...]
    assets: int


def thresholds(
    reports: Sequence[tuple[str, AnyReport]], percentile: float = PERCENTILE
) -> list[Threshold]:
    """Propose gates.

    Args:
        reports: of each asset its name and its report, all of one mode.
        percentile: from 50 to 100; the share of the assets that a bound lets pass.

    Raises:
        InputError: there is no report, or the percentile is out of its range.
    """
    if not reports:
        raise InputError("there is no accepted asset to take thresholds from")
    if not 50 <= percentile <= 100:
        raise InputError(f"a percentile from 50 to 100 was expected, found {percentile:g}")
    mode: Mode = reports[0][1].mode
    proposed = []
    for key, side in _sides(mode).items():
        values = [(value, name) for name, report in reports for value in _value(report, key)]
        if values:
            proposed.append(_threshold(key, side, values, percentile))
    return [each for each in proposed if each is not None]


def gate_file(proposed: Sequence[Threshold], assets: int) -> str:
    """A gate file in TOML, each gate with the asset that sets it."""
    lines = [f"# Proposed from {assets:,} accepted {'asset' if assets == 1 else 'assets'}.", ""]
    lines += ["[gates]"]
    for each in proposed:
        bound = each.bound if isinstance(each.bound, float) else json.dumps(each.bound)
        why = "all have it" if each.asset is None else f"set by {each.asset}"
        if each.beyond:
            why += f"; would fail {', '.join(each.beyond)}"
        if each.assets < assets:
            why += f"; known of {each.assets:,} of {assets:,}"
        why = printable(" ".join(why.split()))  # a comment in TOML may not hold the rest
        lines.append(f'"{each.key}" = {{ {each.side} = {bound} }}  # {why}')
    return "\n".join(lines) + "\n"


@functools.cache
def _sides(mode: Mode) -> Mapping[str, Side]:
    sides: dict[str, Side] = {} if mode == "audit" else dict(_PAIRS)
    for profile in PROFILES:
        for key, table in profile_gates(profile, mode).gates.items():
            for rule in table.rules:
                sides |= dict.fromkeys([key], next(_side(rule.bounds()), "max"))
    changes = {} if mode == "audit" else dict(_changes(known_values(mode)))
    return {**dict(sorted(sides.items())), **changes}


def _side(bounds: Mapping[Any, Allowed]) -> Iterator[Side]:
    for side in bounds:
        if side in ("max", "min", "equals"):
            yield side


def _changes(known: Mapping[str, Known]) -> Iterator[tuple[str, Side]]:
    for key, value in known.items():
        if key.startswith(_CHANGES) and value.kind == "number":
            yield key, "max"


def _value(report: AnyReport, key: str) -> Iterator[float | bool]:
    found = find(report, key)
    value = None if found is None or found.not_examined else found.value
    if isinstance(value, DistanceInterval | ShareInterval):
        value = value.upper
    if isinstance(value, bool | int | float) and math.isfinite(value):
        yield value


def _threshold(
    key: str, side: Side, values: list[tuple[float | bool, str]], percentile: float
) -> Threshold | None:
    distinct = {value for value, _ in values}
    if side == "equals":
        if len(distinct) > 1:
            return None
        return Threshold(key, side, values[0][0], None, (), len(values))
    values.sort(key=lambda each: each[0], reverse=side == "min")
    rank = math.ceil(percentile / 100 * len(values)) - 1
    value, asset = values[rank]
    bound = _rounded(value, side)
    beyond = [name for found, name in values if (found > bound if side == "max" else found < bound)]
    setter = asset if len(distinct) > 1 else None
    return Threshold(key, side, bound, setter, tuple(beyond), len(values))


def _rounded(value: float, side: Side) -> float:
    """A bound that its own asset keeps: a fraction rounded outwards, a count as it is."""
    if value == 0 or isinstance(value, int):
        return value
    step = 10.0 ** (math.floor(math.log10(abs(value))) - _DIGITS + 1)
    whole = math.ceil(value / step) if side == "max" else math.floor(value / step)
    for up in (0, 1):  # the product is rounded too, perhaps to the wrong side
        bound = float(f"{(whole + up * (1 if side == 'max' else -1)) * step:.{_DIGITS}g}")
        if bound >= value if side == "max" else bound <= value:
            return bound
    return value
