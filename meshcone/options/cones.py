"""The constraints a caller can add."""

from __future__ import annotations

from typing import Literal

from pydantic import Field, field_validator, model_validator

from meshcone.options.section import Index, ModelLength, Section, Share, Weight
from meshcone.text import is_line


class Length(Section):
    """A length, relative to the reference's radius or in model units: exactly one of the two."""

    relative: Share | None = Field(None, description="share of the reference's radius")
    model: ModelLength | None = Field(None, description="in the unit of the files")

    @model_validator(mode="after")
    def _exactly_one(self) -> Length:
        if (self.relative is None) == (self.model is None):
            raise ValueError("give either 'relative' or 'model'")
        return self

    def in_frame(self, radius: float) -> float:
        """Return the length in a frame whose unit is ``radius`` model units."""
        if self.model is not None:
            return self.model / radius
        assert self.relative is not None  # noqa: S101 - the validator above has seen to it
        return self.relative


class EdgeCapOptions(Section):
    """A further cap on edge lengths; exactly one of the fields."""

    length: Length | None = Field(None, description="the same cap for every edge")
    times_input: Weight | None = Field(None, description="multiple of each edge's input length")
    times_local_median: Weight | None = Field(
        None, description="multiple of the median input length of the edges at either end"
    )

    @model_validator(mode="after")
    def _exactly_one(self) -> EdgeCapOptions:
        given = [self.length, self.times_input, self.times_local_median]
        if sum(value is not None for value in given) != 1:
            raise ValueError("give one of 'length', 'times_input' and 'times_local_median'")
        return self


class PinOptions(Section):
    """Which vertices stay where they are."""

    boundary: bool = Field(False, description="vertices on open borders")
    region_borders: bool = Field(
        False, description="vertices where two materials or groups meet, or one ends"
    )
    vertices: tuple[Index, ...] = Field(
        (), description="vertices by their index in the file, counted from 0"
    )
    vertices_file: str | None = Field(
        None,
        min_length=1,
        max_length=255,
        description="name of a file with more of them, sent with the source or beside it: a "
        "JSON array, or text with spaces or lines between them",
    )

    @field_validator("vertices_file")
    @classmethod
    def _plain_name(cls, name: str | None) -> str | None:
        if name is None:
            return None
        if name in (".", "..") or set(name) & {"/", "\\"} or not is_line(name):
            raise ValueError("it must be the name of a file, without a folder")
        return name


class ConeOptions(Section):
    """Constraints every answer of the surface program must satisfy."""

    edge_cap: EdgeCapOptions | None = Field(
        None, description="a further cap on edge lengths; the tighter one holds for each edge"
    )
    max_displacement: Length | None = Field(None, description="how far any vertex may move")
    tolerance_band: Length | None = Field(
        None, description="distance of every vertex from the plane at its closest reference point"
    )
    stay: Literal["outside", "inside"] | None = Field(
        None, description="the side of a closed reference that the mesh has to stay on"
    )
    offset: Length | None = Field(
        None, description="how far it has to stay away on that side; 0 where it is not set"
    )
    pin: PinOptions = PinOptions()

    @model_validator(mode="after")
    def _offset_of_a_side(self) -> ConeOptions:
        if self.offset is not None and self.stay is None:
            raise ValueError("'offset' needs 'stay', which says on which side")
        return self
