"""The section ``appearance`` of a report, as data."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field


class _Record(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class ColorDifference(_Record):
    """How different the colours of two surfaces look, over the samples of both."""

    mean: float = Field(description="mean CIEDE2000")
    p95: float = Field(description="95th percentile of CIEDE2000: the value for gates")
    max: float = Field(description="largest CIEDE2000; at seams of textures it means little")
    psnr: float = Field(
        description="peak signal-to-noise ratio of the channels as encoded, decibels; 99 at most"
    )


Compared = ColorDifference | Literal["not_tested"]


class Appearance(_Record):
    """The colours of the mesh beside those of the reference."""

    color_difference: Compared = Field(
        description="of the refined mesh or, where nothing was refined, of the source"
    )
    input: Compared = Field(description="of the source")
    floor: Compared = Field(description="of the reference, against itself")
    why_not_tested: str | None = Field(
        None, description="why colours could not be compared, if they could not"
    )
