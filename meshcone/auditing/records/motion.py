"""The skins and animations of an asset."""

from __future__ import annotations

from pydantic import Field

from meshcone.auditing.records.section import Section


class AnimationRecord(Section):
    """One animation."""

    name: str
    duration: float = Field(description="seconds")
    channels: int
    keys: int


class Motion(Section):
    """Skins by the corners of all triangles, and animations."""

    skinned_corners: int = Field(description="corners that have joints and weights")
    weights_not_normalised: int = Field(description="corners whose weights do not add up to 1")
    weights_not_finite: int = Field(description="corners with a weight that is no number")
    weights_negative: int = Field(description="corners with a weight below 0")
    over_four_influences: int = Field(description="corners that more than four joints move")
    joints_out_of_range: int = Field(description="corners with a joint that the skin does not have")
    without_skin: int = Field(description="corners with weights at a node without a skin")
    unweighted: int = Field(description="corners of a skinned node that no joint moves")
    names: tuple[str, ...] = Field(description="of the animations")
    animations: tuple[AnimationRecord, ...]
    longest: float = Field(description="seconds of the longest animation")
    empty_animations: int = Field(description="animations without a sound channel")
    channels_not_finite: int = Field(description="channels with a key that is no number")
    channels_without_target: int = Field(description="channels that move no node")
