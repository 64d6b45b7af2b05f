"""What an asset costs."""

from __future__ import annotations

from pydantic import Field

from meshcone.auditing.records.section import Section


class Budget(Section):
    """Sizes and counts of the whole file; draws are those of the default scene."""

    file_bytes: int = Field(description="size of the file itself")
    total_bytes: int = Field(description="size of the file and of what was sent with it")
    buffer_bytes: int = Field(description="size of all buffers, images in them included")
    image_bytes: int | None = Field(
        description="size of all images, compressed as they are stored; null where one was not "
        "sent or cannot be had"
    )
    gpu_geometry_bytes: int = Field(
        description="vertex attributes and indices of every mesh that is drawn, as stored; those "
        "that primitives share once"
    )
    gpu_texture_bytes: int | None = Field(
        description="all images as four bytes a texel with mip levels; null where the size of "
        "one could not be read"
    )
    triangles: int = Field(description="drawn, instances counted each time")
    vertices: int = Field(
        description="drawn, split at seams as a GPU needs them, instances counted each time; those "
        "that primitives of a mesh share once"
    )
    draw_calls: int = Field(description="primitives drawn, at every node that places them")
    meshes: int = Field(description="meshes that the file has")
    nodes: int = Field(description="nodes that the file has")
    depth: int = Field(description="levels of the node tree")
    materials: int = Field(description="materials that the file has")
    textures: int = Field(description="textures listed; in an OBJ, maps of its materials")
    images: int = Field(description="images that the file has or names")
    animations: int = Field(description="animations that the file has")
    skins: int = Field(description="skins that the file has")
    joints: int = Field(description="distinct nodes that skins use")
    morph_targets: int = Field(description="of the mesh with the most")
    uv_sets: int = Field(description="of the primitive with the most")
    color_sets: int = Field(description="of the primitive with the most")
    extensions_used: tuple[str, ...] = Field(description="extensions that the file says it uses")
    extensions_required: tuple[str, ...] = Field(
        description="extensions that the file says a reader must know"
    )
