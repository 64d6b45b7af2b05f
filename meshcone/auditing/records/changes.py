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

    scenes: int = Field(0, description="scenes")
    nodes: int = Field(0, description="nodes, with where they are and what is at them")
    meshes: int = Field(0, description="meshes, with the materials they have and where")
    materials: int | None = Field(
        0,
        description="materials, with their factors and textures; null: not tested, because an "
        "image or a library that both files name was not sent",
    )
    libraries: int = Field(0, description="material libraries of an OBJ")
    images: int | None = Field(
        0,
        description="images, by their content; null: not tested, because one that both files name "
        "was not sent",
    )
    uv_sets: int = Field(0, description="sets of texture coordinates, per mesh")
    color_sets: int = Field(0, description="sets of vertex colours, per mesh")
    attributes: int = Field(0, description="other attributes of vertices, per mesh")
    morph_targets: int = Field(0, description="per mesh")
    skins: int = Field(0, description="skins, with what they move")
    animations: int = Field(0, description="animations")
    cameras: int = Field(0, description="cameras")
    lights: int = Field(0, description="lights")
    extensions: int = Field(0, description="extensions that the file uses")
    extras: int = Field(0, description="data of the author's own, and the copyright")


class Changes(Section):
    """All differences of a source from its reference."""

    lost: ChangeCounts = Field(description="the reference has it, and the source lacks it")
    added: ChangeCounts = Field(description="the source has it, and the reference lacks it")
    renamed: ChangeCounts = Field(description="the source has it under another name")
    moved: ChangeCounts = Field(description="the source has it in another place of the tree")
    altered: ChangeCounts = Field(description="the source has another one of that name")
    rows: tuple[Change, ...] = Field(description=f"the first {ROWS_KEPT} of them")
