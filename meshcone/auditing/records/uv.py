"""The texture coordinates of an asset, per set and material."""

from __future__ import annotations

from pydantic import Field

from meshcone.auditing.records.section import Section


class UvSet(Section):
    """One set of texture coordinates on what is drawn with one material.

    All of it is about the coordinates as the first texture is read through them, after
    KHR_texture_transform or the -s and -o of a material library.
    """

    set: int
    material: str
    triangles: int = Field(description="drawn with the material")
    missing: int = Field(description="triangles without the set, if a texture is read through it")
    not_finite: int = Field(description="triangles with a coordinate that is no number")
    degenerate: int = Field(description="triangles with an area, and none in the texture")
    outside: int = Field(description="triangles that leave 0 to 1")
    tiles: bool = Field(
        description="whether a triangle spans more than one tile, as repeated textures do"
    )
    overlap_share: float | None = Field(
        description="share of the covered texels that more than one triangle covers, each "
        "once however many nodes place it; null where the coordinates repeat too often to be drawn"
    )
    inverted_share: float = Field(
        description="share of the surface whose coordinates run the other way round than most, "
        "as its meshes are stored"
    )
    unused_share: float | None = Field(description="share of the texels that nothing covers")
    texel_density_median: float | None = Field(
        description="texels per model unit, by area, as the set's first texture is scaled; null "
        "without a texture"
    )
    texel_density_p5: float | None = Field(description="5th percentile of the same")
    texel_density_p95: float | None = Field(description="95th percentile of the same")
    gutter: int | None = Field(
        description="between the closest two islands, in 1/1024 of the texture's side, up to 64; "
        "null where they could not be drawn at 1,024 texels a side"
    )
    resolution: int | None = Field(description="texels along a side that these are found at")


class Uv(Section):
    """All sets together: counts are sums, shares the worst of any set."""

    sets: int = Field(description="pairs of a set and a material")
    missing: int = Field(description="triangles whose material has a texture and that lack its set")
    not_finite: int = Field(description="triangles with a coordinate that is no number")
    degenerate: int = Field(description="triangles with an area, and none in the texture")
    outside: int = Field(description="triangles that leave 0 to 1")
    tiles: bool = Field(
        description="whether a triangle spans more than one tile, as repeated textures do"
    )
    overlap_share: float | None = Field(
        description="largest share of a set's covered texels that more than one triangle covers, "
        "each once however many nodes place it; null where it was not tested"
    )
    inverted_share: float = Field(
        description="largest share of a set's surface whose coordinates run the other way round "
        "than most, as its meshes are stored"
    )
    unused_share: float | None = Field(
        description="largest share of a set's texels that nothing covers; null where it was not "
        "tested"
    )
    texel_density_min: float | None = Field(
        description="least median of any material, in texels per model unit, as its texture is "
        "scaled; null where the size of a texture could not be read, and without any"
    )
    texel_density_max: float | None = Field(
        description="greatest median of any material, in texels per model unit, as its texture is "
        "scaled; null where the size of a texture could not be read, and without any"
    )
    gutter: int | None = Field(
        description="narrowest of any set, in 1/1024 of the texture's side, up to 64; null where "
        "one could not be drawn at 1,024 texels a side"
    )
    by_material: tuple[UvSet, ...]
