"""What differs between a reference and a source besides the surface."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from meshcone.auditing.records.section import Section

ChangeKind = Literal["lost", "added", "renamed", "moved", "altered"]

ROWS_KEPT = 500
"""Differences that are listed; all of them are counted."""


class Change(Section):
    """One difference."""

    kind: ChangeKind
    what: str = Field(description="what kind of thing, such as materials")
    where: str = Field(description="the thing's name in the reference, or its path; if added, here")
    reference: str | None = Field(description="as the reference has it; null where it has not")
    source: str | None = Field(description="as the source has it; null where it has not")
    words: str


class ChangeCounts(Section):
    """How many of each kind of thing."""

    scenes: int = 0
    nodes: int = 0
    meshes: int = 0
    materials: int = 0
    libraries: int = 0
    images: int = 0
    uv_sets: int = Field(0, description="sets of texture coordinates, per mesh")
    color_sets: int = Field(0, description="sets of vertex colours, per mesh")
    attributes: int = Field(0, description="other attributes of vertices, per mesh")
    morph_targets: int = Field(0, description="per mesh")
    skins: int = 0
    animations: int = 0
    cameras: int = 0
    lights: int = 0
    extensions: int = 0
    extras: int = 0


class Changes(Section):
    """All differences of a source from its reference."""

    lost: ChangeCounts
    added: ChangeCounts
    renamed: ChangeCounts
    moved: ChangeCounts
    altered: ChangeCounts
    rows: tuple[Change, ...] = Field(description=f"the first {ROWS_KEPT} of them")
