"""How narrowly the proven deviation is determined."""

from __future__ import annotations

from pydantic import Field

from meshcone.options.section import Section


class DeviationOptions(Section):
    """How narrowly the proven deviation is determined, and what it may cost."""

    prove: bool = Field(
        True, description="whether to prove how far the surfaces go from each other at all"
    )
    width: float = Field(
        1e-4,
        ge=1e-9,
        le=1e6,
        allow_inf_nan=False,
        description="how wide the proven interval may stay, relative to the radius",
    )
    share: float = Field(
        1e-3,
        ge=0,
        le=0.5,
        description="how wide it may stay as a share of its upper end; the larger of both counts",
    )
    pieces: int = Field(
        500_000,
        ge=0,
        le=20_000_000,
        description="pieces that may be made of either surface beyond its faces, some "
        "microseconds each; after that the interval stays as wide as it is",
    )
