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

    count: int
    names: tuple[str, ...]
    unnamed: int
    unused: int = Field(description="materials that nothing is drawn with")
    undefined: int = Field(description="materials that are named and nowhere defined")
    missing_libraries: int = Field(description="material libraries that were not sent")
    duplicates: int = Field(description="materials that differ from an earlier one in name alone")
    same_names: int = Field(description="materials with the name of an earlier one")
    blended: int
    masked: int
    double_sided: int
    without_material: int = Field(description="triangles drawn with the default material")
    items: tuple[MaterialRecord, ...]
