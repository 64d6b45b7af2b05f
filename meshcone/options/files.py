"""Which parts of the source's file are refined."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from meshcone.options.section import Index, Section

PartKey = Index | Annotated[str, Field(min_length=1, max_length=200)]


class SelectOptions(Section):
    """What to refine: the faces that every list given here names; the rest stays as it is."""

    nodes: tuple[PartKey, ...] = Field(
        (), max_length=1000, description="nodes of a glTF, with all below them"
    )
    meshes: tuple[PartKey, ...] = Field(
        (), max_length=1000, description="meshes of a glTF, objects (`o`) of an OBJ"
    )
    groups: tuple[PartKey, ...] = Field((), max_length=1000, description="groups (`g`) of an OBJ")
    materials: tuple[PartKey, ...] = Field((), max_length=1000, description="materials")

    def given(self) -> dict[str, tuple[str | int, ...]]:
        """The lists that are not empty, by their names."""
        lists = {name: getattr(self, name) for name in type(self).model_fields}
        return {name: keys for name, keys in lists.items() if keys}
