"""Materials, textures and images of a glTF (glTF 2.0, sections 3.8 and 3.9)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import get_args

from meshcone.assets.content import Image, Material, TextureUse
from meshcone.assets.content.records import AlphaMode, Wrap
from meshcone.assets.gltf.accessors import Accessors
from meshcone.assets.gltf.element import Element
from meshcone.assets.gltf.lenient import Lenient
from meshcone.assets.gltf.parameters import parameters

_WRAPS: dict[int, Wrap] = {10497: "repeat", 33648: "mirror", 33071: "clamp"}
_NEAREST = 9728
_PBR_SLOTS = {"baseColorTexture": "base_color", "metallicRoughnessTexture": "metallic_roughness"}
_SLOTS = {
    "normalTexture": "normal",
    "occlusionTexture": "occlusion",
    "emissiveTexture": "emissive",
}
# Extensions of a texture that name another image for those who can read it.
_IMAGE_EXTENSIONS = (
    "EXT_texture_webp",
    "KHR_texture_basisu",
    "EXT_texture_avif",
    "MSFT_texture_dds",
)


class MaterialReader:
    """Reads the materials and images of one document."""

    def __init__(self, root: Lenient) -> None:
        self._root = root
        self._textures = root.children("textures")
        self._images = root.children("images")
        self._samplers = root.children("samplers")

    @property
    def textures(self) -> int:
        """How many textures the document lists."""
        return len(self._textures)

    def materials(self) -> tuple[Material, ...]:
        """All materials, with the textures bound to them."""
        return tuple(map(self._material, self._root.children("materials")))

    def images(self, accessors: Accessors) -> tuple[Image, ...]:
        """All images, with their bytes where they can be had."""
        return tuple(_image(image, accessors) for image in self._images)

    def _material(self, material: Lenient) -> Material:
        pbr = material.child("pbrMetallicRoughness")
        factors = pbr or Lenient(Element({}), material.faults)
        red, green, blue, alpha = factors.numbers("baseColorFactor", (1.0, 1.0, 1.0, 1.0))
        glow = material.numbers("emissiveFactor", (0.0, 0.0, 0.0))
        return Material(
            name=material.name,
            base_color=(red, green, blue, alpha),
            metallic=factors.number("metallicFactor", 1.0),
            roughness=factors.number("roughnessFactor", 1.0),
            emissive=(glow[0], glow[1], glow[2]),
            alpha_mode=_alpha_mode(material),
            alpha_cutoff=material.number("alphaCutoff", 0.5),
            double_sided=material.flag("doubleSided"),
            textures=tuple(self._uses(material, pbr)),
            extensions=material.extensions(),
            parameters=tuple(
                (f"{name} {key}", told)
                for name in material.extensions()
                if (extension := material.extension(name))
                for key, told in parameters(extension.element.value).items()
            ),
        )

    def _uses(self, material: Lenient, pbr: Lenient | None) -> Iterator[TextureUse]:
        for holder, slots in ((pbr, _PBR_SLOTS), (material, _SLOTS)):
            for key, slot in slots.items():
                info = holder.child(key) if holder else None
                if info:
                    yield self._use(info, slot)
        for name in material.extensions():
            extension = material.extension(name)
            for key in sorted(extension.members()) if extension else ():
                # Every extension of materials that Khronos has ratified names textures so.
                info = extension.child(key) if extension and key.endswith("Texture") else None
                if info:
                    yield self._use(info, f"{name}.{key}")

    def _use(self, info: Lenient, slot: str) -> TextureUse:
        number = info.reference("index", len(self._textures), "texture")
        nothing = Lenient(Element({}), info.faults)
        texture = nothing if number is None else self._textures[number]
        sampler_number = texture.reference("sampler", len(self._samplers), "sampler")
        sampler = nothing if sampler_number is None else self._samplers[sampler_number]
        transform = info.extension("KHR_texture_transform") or nothing
        offset = transform.numbers("offset", (0.0, 0.0))
        scale = transform.numbers("scale", (1.0, 1.0))
        uv_set = transform.integer("texCoord")
        if uv_set is None:
            uv_set = info.integer("texCoord") or 0
        images = list(self._images_of(texture))
        return TextureUse(
            slot=slot,
            image=images[0][1] if images else None,
            uv_set=uv_set,
            wrap=(_wrap(sampler, "wrapS"), _wrap(sampler, "wrapT")),
            nearest=sampler.integer("magFilter") == _NEAREST,
            offset=(offset[0], offset[1]),
            rotation=transform.number("rotation", 0.0),
            scale=(scale[0], scale[1]),
            strength=info.number("scale" if slot.lower().endswith("normal") else "strength", 1.0),
            others=tuple(images[1:]),
        )

    def _images_of(self, texture: Lenient) -> Iterator[tuple[str, int]]:
        """The image for those who know no extension, then those of extensions, with their names."""
        others = [name for name in texture.extensions() if name not in _IMAGE_EXTENSIONS]
        for name in ("", *_IMAGE_EXTENSIONS, *others):
            holder = texture.extension(name) if name else texture
            if name in others and holder and "source" not in holder.element.value:
                continue  # which says something else
            found = holder.reference("source", len(self._images), "image") if holder else None
            if found is not None:
                yield name, found


def _image(image: Lenient, accessors: Accessors) -> Image:
    media_type = image.text("mimeType")
    unread = Image(image.name, image.pointer.lstrip("/"), None, media_type)

    def read(element: Element) -> Image:
        view = element.reference("bufferView", len(accessors.views), "buffer view")
        if view is not None:
            data = accessors.view_bytes(view)
            return Image(unread.name, unread.place, data, media_type, embedded=True)
        uri = element.text("uri")
        if uri is None:
            raise element.error("uri", "an image needs 'uri' or 'bufferView'")
        found = accessors.buffers.named(uri, element)
        return Image(
            name=unread.name if found.embedded else found.name,
            place=unread.place,
            data=found.data,
            media_type=media_type or found.media_type,
            embedded=found.embedded,
        )

    return image.attempt(read) or unread


def _alpha_mode(material: Lenient) -> AlphaMode:
    mode = material.text("alphaMode") or "OPAQUE"
    known: tuple[AlphaMode, ...] = get_args(AlphaMode)
    for each in known:
        if mode == each:
            return each
    material.faults.note(material.element.place("alphaMode"), f"unknown alpha mode '{mode[:20]}'")
    return "OPAQUE"


def _wrap(sampler: Lenient, key: str) -> Wrap:
    return _WRAPS.get(sampler.integer(key) or 0, "repeat")
