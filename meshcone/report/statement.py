"""The sentence that a report proves."""

from __future__ import annotations

from decimal import ROUND_CEILING, Context, Decimal

from meshcone.gates.units import Unit
from meshcone.quality.deviation.records import Deviation

_UP = Context(prec=3, rounding=ROUND_CEILING)


def statement(deviation: Deviation, unit: Unit) -> str:
    """Say what is proven of both surfaces, rounded up to three digits.

    Args:
        deviation: the proven intervals.
        unit: what it is told in.
    """
    extra = None if deviation.extra is None else deviation.extra.upper_model
    return f"{within(extra, deviation.missing.upper_model, unit)} (proven)"


def within(extra: float | None, missing: float, unit: Unit) -> str:
    """Say how close two surfaces are, rounded up to three digits.

    Args:
        extra: no point of the mesh is farther from the reference, in model units; None where the
            reference is points.
        missing: no point of the reference is farther from the mesh.
        unit: what it is told in.
    """
    if extra is None:
        return f"every point of the reference within {_told(missing, unit)}"
    return (
        f"every point within {_told(extra, unit)} of the reference, "
        f"every point of the reference within {_told(missing, unit)}"
    )


def _told(distance: float, unit: Unit) -> str:
    return f"{rounded_up(unit.at_most(distance))} {unit.name}"


def rounded_up(value: float) -> str:
    """Write a number with three digits, none below it."""
    return f"{float(_UP.create_decimal(Decimal(value))):.3g}"
