"""What an asset costs: bytes, triangles, draw calls and everything else that is counted."""

from __future__ import annotations

from meshcone.assets.content import Content, Primitive
from meshcone.assets.pictures import Picture
from meshcone.auditing.records.budget import Budget
from meshcone.auditing.subject import Subject

_MIP_SHARE = 4 / 3  # 1 + 1/4 + 1/16 + …
_TEXEL_BYTES = 4


def budget_of(subject: Subject, pictures: tuple[Picture, ...]) -> Budget:
    """Count what a file has."""
    content = subject.content
    drawn = {(draw.mesh, draw.primitive) for draw in content.draws}
    primitives = [content.meshes[mesh].primitives[number] for mesh, number in drawn]
    everywhere = [each for mesh in content.meshes for each in mesh.primitives]
    texels = [picture.texels for picture in pictures]
    return Budget(
        file_bytes=len(subject.file.data),
        total_bytes=len(subject.file.data) + sum(map(len, subject.file.resources.values())),
        buffer_bytes=content.buffer_bytes,
        image_bytes=_image_bytes([image.data for image in content.images]),
        gpu_geometry_bytes=_geometry_bytes(primitives),
        gpu_texture_bytes=_texture_bytes(texels),
        triangles=len(subject.asset.triangles),
        vertices=_vertices(subject),
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


def _geometry_bytes(primitives: list[Primitive]) -> int:
    shared = {number: size for each in primitives for number, size in each.gpu_bytes.items()}
    shared.pop(-1, None)
    return sum(shared.values()) + sum(each.gpu_bytes.get(-1, 0) for each in primitives)


def _vertices(subject: Subject) -> int:
    """At every node; primitives of a mesh that share vertices have them once."""
    content = subject.content
    if content.stored is not None:
        return len(content.stored)
    meshes = content.meshes
    return sum(meshes[draw.mesh].primitives[draw.primitive].vertices for draw in content.draws)


def _image_bytes(images: list[bytes | None]) -> int | None:
    known = [len(data) for data in images if data is not None]
    return None if len(known) < len(images) else sum(known)


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
