"""What the gates on a deviation need to know of it."""

from __future__ import annotations

from dataclasses import dataclass

from meshcone.gates.rules import GateTable

_SECTION = "deviation"
# Gates on an interval, and the directions they are about.
_ABOUT = {
    "deviation.extra": ("extra",),
    "deviation.missing": ("missing",),
    "deviation.max": ("extra", "missing"),
}


@dataclass(frozen=True)
class Bars:
    """Values that each direction's deviation is to be told from, relative to the radius."""

    extra: tuple[float, ...] = ()
    missing: tuple[float, ...] = ()


def bars_of(gates: GateTable, radius: float) -> Bars:
    """Collect the bounds on the intervals of a deviation.

    There are none where a gate bounds an end or a width by itself: these are good for nothing
    before the interval is as narrow as the options ask.

    Args:
        gates: by the name of a value.
        radius: of the reference, in model units.
    """
    about = [key for key in gates if key.partition(".")[0] == _SECTION]
    if any(key not in _ABOUT for key in about):
        return Bars()
    found: dict[str, set[float]] = {"extra": set(), "missing": set()}
    for key in about:
        for bound, allowed in gates[key].bounds().items():
            if isinstance(allowed, float) and not isinstance(allowed, bool):
                bar = allowed / radius if bound.endswith("_model") else allowed
                for direction in _ABOUT[key]:
                    found[direction].add(max(bar, 0.0))
    return Bars(*(tuple(sorted(found[direction])) for direction in ("extra", "missing")))
