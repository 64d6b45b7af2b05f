"""What came of a tolerance that a refinement was to reach."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field


class _Record(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class PlaceBeyond(_Record):
    """A point of one surface that is farther from the other than the tolerance."""

    on: Literal["mesh", "reference"] = Field(description="the surface it is a point of")
    position: tuple[float, float, float] = Field(description="model units")
    distance_model: float = Field(description="to the other surface, in model units")


class WithinRecord(_Record):
    """Whether a tolerance is proven to be reached, and where it is not."""

    asked: str = Field(description="the tolerance as it was given")
    limit_model: float = Field(description="the tolerance in model units")
    unit: str = Field(description="what the unit of the files is called")
    reached: bool = Field(
        description="whether every point of either surface is proven to be within it"
    )
    attempts: int = Field(description="refinements made; the closest of them is the answer")
    places: tuple[PlaceBeyond, ...] = Field(
        description="up to ten samples, vertices and points of the proof that are beyond it, the "
        "worst first; none where it is reached, or where the proof alone is missing"
    )
