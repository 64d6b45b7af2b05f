"""What came of faces that were to be added."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

Stopped = Literal["tolerance", "budget", "stagnation", "harm"]


class DetailRecord(BaseModel):
    """Faces of the source that were divided, and why no more of them."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    faces_before: int = Field(description="of the source; those without area are not among them")
    faces_after: int = Field(description="of the refined file, likewise")
    faces_allowed: int = Field(description="the limit that the options set")
    divided: int = Field(description="faces of the source that were divided")
    swapped: int = Field(
        0,
        description="of the faces afterwards, those with corners in several faces of the source; "
        "0 unless `flips` is `chart`",
    )
    levels: int = Field(description="how often faces were chosen and divided")
    stopped: Stopped = Field(
        description="tolerance: no sample is farther than it; budget: the faces allowed are "
        "spent; stagnation: another level did not help, or made faces pass through each other; "
        "harm: the answer with more faces was worse than the input somewhere, and none were added"
    )
