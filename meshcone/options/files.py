"""What of the files is read, and which parts of the source are refined."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from meshcone.options.section import Index, ModelLength, Section

PartKey = Index | Annotated[str, Field(min_length=1, max_length=200)]


SceneKey = Index | Annotated[str, Field(min_length=1, max_length=200)]
Level = Annotated[int, Field(ge=0, le=100)]
Member = Annotated[str, Field(min_length=1, max_length=1000)]


class ReferenceOptions(Section):
    """What of the reference is read, where that is not what is read of the source."""

    member: Member | None = Field(
        None,
        description="which file of a ZIP archive is the reference; without it the path of the "
        "source in its archive, where this one has it too, or else the obvious mesh",
    )
    scene: SceneKey | None = Field(
        None,
        description="which scene of a glTF is the reference, or all; without it the one that is "
        "read of the source, where this file has one of that name or index, or else its default",
    )
    lod: Level = Field(0, description="which level of detail of a glTF is the reference")
    chord: ModelLength | None = Field(
        None,
        description="how far the triangles of a STEP may lie from its surfaces, in millimetres; "
        "without it 0.05 % of half the diagonal of its largest part",
    )


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
