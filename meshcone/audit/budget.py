"""What an asset costs: bytes, triangles, draw calls and everything else that is counted."""

from __future__ import annotations

from typing import Self

from pydantic import Field

from meshcone.assets.content import Content
from meshcone.assets.pictures import Picture
from meshcone.audit.records import Section
from meshcone.audit.subject import Subject

_MIP_SHARE = 4 / 3  # 1 + 1/4 + 1/16 + …
_TEXEL_BYTES = 4


class Budget(Section):
    """Sizes and counts of the whole file; draws are those of the default scene."""

    file_bytes: int = Field(description="size of the file itself")
    total_bytes: int = Field(description="size of the file and of what was sent with it")
    buffer_bytes: int = Field(description="size of all buffers, images in them included")
    image_bytes: int = Field(description="size of all images, compressed as they are stored")
    gpu_geometry_bytes: int = Field(
        description="vertex attributes and indices of every mesh that is drawn, as stored"
    )
    gpu_texture_bytes: int | None = Field(
        description="all images as four bytes a texel with mip levels; null where the size of "
        "one could not be read"
    )
    triangles: int = Field(description="drawn, instances counted each time")
    vertices: int = Field(description="drawn, split at seams as a GPU needs them")
    draw_calls: int = Field(description="primitives drawn, at every node that places them")
    meshes: int
    nodes: int
    depth: int = Field(description="levels of the node tree")
    materials: int
    textures: int = Field(description="textures listed; in an OBJ, maps of its materials")
    images: int
    animations: int
    skins: int
    joints: int = Field(description="distinct nodes that skins use")
    morph_targets: int = Field(description="of the mesh with the most")
    uv_sets: int = Field(description="of the primitive with the most")
    color_sets: int = Field(description="of the primitive with the most")
    extensions_used: tuple[str, ...]
    extensions_required: tuple[str, ...]

    @classmethod
    def of(cls, subject: Subject, pictures: tuple[Picture, ...]) -> Self:
        """Count what a file has."""
        content = subject.content
        drawn = {(draw.mesh, draw.primitive) for draw in content.draws}
        primitives = [content.meshes[mesh].primitives[number] for mesh, number in drawn]
        everywhere = [each for mesh in content.meshes for each in mesh.primitives]
        placed = [content.meshes[draw.mesh].primitives[draw.primitive] for draw in content.draws]
        texels = [picture.texels for picture in pictures]
        return cls(
            file_bytes=subject.data_bytes,
            total_bytes=subject.data_bytes + subject.resource_bytes,
            buffer_bytes=content.buffer_bytes,
            image_bytes=sum(len(image.data or b"") for image in content.images),
            gpu_geometry_bytes=sum(primitive.gpu_bytes for primitive in primitives),
            gpu_texture_bytes=_texture_bytes(texels),
            triangles=len(subject.asset.triangles),
            vertices=sum(primitive.vertices for primitive in placed),
            draw_calls=len(content.draws) + content.other_draws,
            meshes=len(content.meshes),
            nodes=len(content.nodes),
            depth=max((node.depth for node in content.nodes), default=0),
            materials=len(content.materials),
            textures=content.textures,
            images=len(content.images),
            animations=len(content.animations),
            skins=len(content.skins),
            joints=len({joint for skin in content.skins for joint in skin.joints}),
            morph_targets=max((each.targets for each in everywhere), default=0),
            uv_sets=_most_sets(content, "TEXCOORD_"),
            color_sets=_most_sets(content, "COLOR_"),
            extensions_used=content.extensions_used,
            extensions_required=content.extensions_required,
        )


def _texture_bytes(texels: list[int | None]) -> int | None:
    known = [count for count in texels if count is not None]
    if len(known) < len(texels):
        return None
    return round(sum(known) * _TEXEL_BYTES * _MIP_SHARE)


def _most_sets(content: Content, prefix: str) -> int:
    return max(
        (
            sum(name.startswith(prefix) for name in primitive.attributes)
            for mesh in content.meshes
            for primitive in mesh.primitives
        ),
        default=0,
    )
