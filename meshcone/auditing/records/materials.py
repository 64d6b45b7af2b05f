"""The materials of an asset."""

from __future__ import annotations

from pydantic import Field

from meshcone.auditing.records.section import Section


class MaterialRecord(Section):
    """One material."""

    name: str
    base_color: tuple[float, float, float, float] = Field(description="linear RGBA")
    metallic: float
    roughness: float
    emissive: tuple[float, float, float] = Field(description="linear RGB")
    alpha_mode: str
    double_sided: bool
    textures: tuple[str, ...] = Field(description="slots that have a texture")
    extensions: tuple[str, ...]
    triangles: int = Field(description="drawn with it")
    defined: bool = Field(description="whether the file, or a library that was sent, defines it")


class Materials(Section):
    """All materials together, and each of them."""

    count: int = Field(description="materials that the file has or names")
    names: tuple[str, ...] = Field(description="of the materials")
    unnamed: int = Field(description="materials without a name")
    unused: int = Field(description="materials that nothing is drawn with")
    undefined: int = Field(
        description="materials that are named and nowhere defined, in a glTF each time a primitive "
        "does so"
    )
    missing_libraries: int = Field(description="material libraries that were not sent")
    duplicates: int = Field(description="materials that differ from an earlier one in name alone")
    same_names: int = Field(description="materials with the name of an earlier one")
    blended: int = Field(description="materials that are blended by their opacity")
    masked: int = Field(description="materials that are cut out by their opacity")
    double_sided: int = Field(description="materials that show the backs of faces")
    without_material: int = Field(description="triangles drawn with the default material")
    items: tuple[MaterialRecord, ...]
