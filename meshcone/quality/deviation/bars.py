"""What the gates on a deviation need to know of it."""

from __future__ import annotations

from dataclasses import dataclass

from meshcone.gates.rules import GateRule, GateTable

_SECTION = "deviation"
# Gates on an interval, and the directions they are about.
_ABOUT = {
    "deviation.extra": ("extra",),
    "deviation.missing": ("missing",),
    "deviation.max": ("extra", "missing"),
}


_AREA = "deviation.area_beyond"


@dataclass(frozen=True)
class AreaBars:
    """A tolerance, and the shares of area that what is beyond it is to be told from."""

    tolerance: float
    shares: tuple[float, ...]


@dataclass(frozen=True)
class Bars:
    """Values that each direction's deviation is to be told from, relative to the radius."""

    extra: tuple[float, ...] = ()
    missing: tuple[float, ...] = ()
    area: AreaBars | None = None


def bars_of(gates: GateTable, radius: float) -> Bars:
    """Collect the bounds on the intervals of a deviation.

    There are none where a gate bounds an end or a width by itself: these are good for nothing
    before the interval is as narrow as the options ask.

    Args:
        gates: by the name of a value.
        radius: of the reference, in model units.
    """
    area = _area_bars(gates[_AREA], radius) if _AREA in gates else None
    about = [key for key in gates if key.partition(".")[0] == _SECTION and key != _AREA]
    if any(key not in _ABOUT for key in about):
        return Bars(area=area)
    found: dict[str, set[float]] = {"extra": set(), "missing": set()}
    for key in about:
        for bound, allowed in gates[key].bounds().items():
            if isinstance(allowed, float) and not isinstance(allowed, bool):
                bar = allowed / radius if bound.endswith("_model") else allowed
                for direction in _ABOUT[key]:
                    found[direction].add(max(bar, 0.0))
    return Bars(tuple(sorted(found["extra"])), tuple(sorted(found["missing"])), area)


def _area_bars(rule: GateRule, radius: float) -> AreaBars:
    tolerance = rule.tolerance
    if tolerance is None:
        assert rule.tolerance_model is not None  # noqa: S101 - gates are checked before any work
        tolerance = rule.tolerance_model / radius
    shares = [allowed for allowed in rule.bounds().values() if isinstance(allowed, float)]
    return AreaBars(tolerance, tuple(shares))
