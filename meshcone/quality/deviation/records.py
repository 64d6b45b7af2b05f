"""The section ``deviation`` of a report, as data."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Field


class _Record(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class DistanceInterval(_Record):
    """A distance, known to lie between two ends; relative to the radius.

    A gate can name the section itself: it passes where the upper end is within the bound,
    fails where the lower end is beyond it, and is not tested between.
    """

    lower: float = Field(description="the point `at` is at least this far away")
    upper: float = Field(
        description="no point of any triangle is farther; those with two corners at one place "
        "have no area and are left out"
    )
    width: float = Field(description="upper minus lower")
    lower_model: float = Field(description="the lower end in model units")
    upper_model: float = Field(description="the upper end in model units, rounded up")
    at: tuple[float, float, float] | None = Field(
        description="the farthest point that was met, in model units; where the source was "
        "aligned, in the place it was brought to; null where there is none"
    )
    proven: bool = Field(
        description="whether the interval is what was asked for: narrow enough, or enough to "
        "decide the gates about it; both ends hold in any case"
    )


class ProvenInterval(DistanceInterval):
    """Both ends are proven, of all points of all triangles."""

    at: tuple[float, float, float] = Field(
        description="the farthest point that was met, in model units; where the source was "
        "aligned, in the place it was brought to"
    )


class ShareInterval(_Record):
    """A share of area, known to lie between two ends; a gate can name the section itself."""

    lower: float = Field(
        description="of pieces that are farther in all of their points; it counts on the "
        "closest points found"
    )
    upper: float = Field(description="1 minus the area of pieces that are proven to be within")
    width: float = Field(description="upper minus lower")
    proven: bool = Field(description="whether the interval is narrow, or decides the gate about it")


class AreaBeyond(ShareInterval):
    """Share of the area that is farther away than a tolerance: the larger of both surfaces'."""

    tolerance: float = Field(description="relative to the radius")
    tolerance_model: float = Field(description="in model units")
    extra: ShareInterval = Field(description="of the mesh's area, from the reference")
    missing: ShareInterval = Field(description="of the reference's area, from the mesh")


class Deviation(_Record):
    """How far the two surfaces go from each other: of all points of all triangles."""

    extra: ProvenInterval | None = Field(
        description="how far the mesh goes beyond the reference: its farthest point's distance; "
        "null where the reference is points, for nothing is known between them"
    )
    missing: ProvenInterval = Field(
        description="how far the reference is not covered: the distance of the point of it "
        "that is farthest from the mesh"
    )
    max: ProvenInterval | None = Field(
        description="the larger of both, which is the Hausdorff distance of the surfaces; null "
        "where one of them is"
    )
    outside: DistanceInterval | None = Field(
        None,
        description="how far the mesh goes outside of a closed reference; which side a point is "
        "on counts on the winding number and the closest points found; absent where the "
        "reference is open",
    )
    inside: DistanceInterval | None = Field(
        None, description="how far it goes inside of a closed reference, likewise"
    )
    area_beyond: AreaBeyond | None = Field(
        None, description="absent unless a gate is about it, which gives the tolerance"
    )
