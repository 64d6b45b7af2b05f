"""The sentence that a report proves."""

from __future__ import annotations

from decimal import ROUND_CEILING, Context, Decimal

from meshcone.quality.deviation.records import Deviation

_UP = Context(prec=3, rounding=ROUND_CEILING)


def statement(deviation: Deviation, unit: str) -> str:
    """Say what is proven of both surfaces, rounded up to three digits.

    Args:
        deviation: the proven intervals.
        unit: what the unit of the files is called.
    """
    extra, missing = (
        f"{_rounded_up(each.upper_model)} {unit}" for each in (deviation.extra, deviation.missing)
    )
    return (
        f"every point within {extra} of the reference, "
        f"every point of the reference within {missing} (proven)"
    )


def _rounded_up(value: float) -> str:
    return f"{float(_UP.create_decimal(Decimal(value))):.3g}"
