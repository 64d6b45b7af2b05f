"""The colours of an asset's surface: factor, texture, vertex colour (glTF 2.0, section 3.9.2)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from meshcone.appearance.texture import sample
from meshcone.assets import Asset
from meshcone.assets.content import Content, Draw, Material, TextureUse, placed
from meshcone.assets.pictures import Picture, PictureDecoder, UndecodableError, read_picture
from meshcone.surface.arrays import Floats, Ints

_DEFAULT = Material("")
# The older model of materials names its colour otherwise.
_SLOTS = ("base_color", "KHR_materials_pbrSpecularGlossiness.diffuseTexture")
_MOST_TEXELS = 1 << 28  # of all images of an asset; decoding them takes some seconds
_KEPT_TEXELS = 1 << 24  # of all images, up to which they are decoded once: 64 MiB
_NAMED = 3  # faults in one sentence
_GROUND = 0.2140  # what shows through: half of white as encoded, in linear light


@dataclass(frozen=True)
class Spots:
    """Points of a surface.

    Attributes:
        faces: (k,) the asset's faces they lie on.
        weights: (k, 3) their barycentric coordinates there.
    """

    faces: Ints
    weights: Floats


def shown(colours: Floats) -> Floats:
    """Linear RGB (k, 3) of linear RGBA (k, 4) over a grey ground."""
    opacity = colours[:, 3:]
    return np.asarray(opacity * colours[:, :3] + (1 - opacity) * _GROUND)


class Paint:
    """What colour an asset has, anywhere on its surface.

    Attributes:
        name: the asset's file.
    """

    def __init__(self, asset: Asset) -> None:
        self._asset = asset
        self._faults: dict[str, None] = {}
        self._decoded: dict[int, NDArray[np.uint8]] = {}
        self.name = asset.name

    @property
    def claims_colour(self) -> bool:
        """Whether the file has colours at vertices or names materials, be they known or not."""
        return self.has_colour or any(draw.material is not None for draw, _ in self._drawn)

    @property
    def has_colour(self) -> bool:
        """Whether the file says what colour any of it has."""
        return any(
            "COLOR_0" in draw.attributes or (draw.material is not None and material.defined)
            for draw, material in self._drawn
        )

    @property
    def is_at_hand(self) -> bool:
        """Whether its colours can be had now without decoding an image."""
        return self.has_colour and self._pictures.keys() <= self._decoded.keys()

    @property
    def varies(self) -> bool:
        """Whether a triangle may have more than one colour."""
        return any(
            "COLOR_0" in draw.attributes or _texture(material) is not None
            for draw, material in self._drawn
        )

    @property
    def why_unknown(self) -> str | None:
        """Why colours that were asked for are not known; None if all of them are."""
        if not self._faults:
            return None
        named = "; ".join(list(self._faults)[:_NAMED])
        more = len(self._faults) - _NAMED
        return f"{self.name}: {named}{f'; and {more:,} more' if more > 0 else ''}"

    def colours(self, spots: Sequence[Spots]) -> list[Floats]:
        """Linear RGBA (k, 4) at each of several sets of points; NaN where it is not known.

        Alpha is 1 in opaque materials, and 0 or 1 where the material cuts out.
        """
        if not spots:
            return []
        faces = np.concatenate([each.faces for each in spots])
        weights = np.concatenate([each.weights for each in spots])
        found = self._colours(faces, weights)
        ends = np.cumsum([len(each.faces) for each in spots])
        return np.split(found, ends[:-1])

    def coordinates(self, faces: Ints) -> Floats | None:
        """Where the corners (k, 3, 2) of faces are in the texture of their colour, as stored.

        Without one, by the first set of coordinates; 0 without any. None where no face has some.
        """
        rows = self._asset.kept[faces]
        owners, places = self._places
        found = np.zeros((len(faces), 3, 2))
        known = False
        for number in np.unique(owners[rows]):
            draw, material = self._drawn[number]
            use = _texture(material)
            attribute = draw.attributes.get(f"TEXCOORD_{use.uv_set if use is not None else 0}")
            if attribute is None:
                continue
            known = True
            here = np.flatnonzero(owners[rows] == number)
            corners = attribute.corners[places[rows[here]]]
            values = attribute.read(np.maximum(corners.ravel(), 0)).reshape(len(here), 3, -1)
            there = (corners >= 0)[..., None] & np.isfinite(values[..., :2])
            found[here] = np.where(there, values[..., :2], 0)
        return found if known else None

    def _colours(self, faces: Ints, weights: Floats) -> Floats:
        rows = self._asset.kept[faces]
        owners, places = self._places
        order = np.argsort(owners[rows], kind="stable")
        bounds = np.searchsorted(owners[rows[order]], np.arange(len(self._drawn) + 1))
        colours = np.empty((len(faces), 4))
        with PictureDecoder() as decoder:
            images = _Images(self._pictures, decoder, self._decoded)
            for number in self._by_image:
                here = order[bounds[number] : bounds[number + 1]]
                if len(here):
                    draw, material = self._drawn[number]
                    patch = _Patch(draw, places[rows[here]], weights[here])
                    colours[here] = self._painted(patch, material, images)
            images.let_go()
        return colours

    def _painted(self, patch: _Patch, material: Material, images: _Images) -> Floats:
        if not material.defined:
            self._note(f"no library defines the material '{material.name}'")
            return np.full((len(patch.weights), 4), np.nan)
        colours = np.array(material.base_color) * patch.vertex_colours()
        use = _texture(material)
        if use is not None:
            try:
                pixels = images.pixels(use.image)
            except UndecodableError as error:
                self._note(str(error))
                return np.full((len(patch.weights), 4), np.nan)
            colours = colours * sample(pixels, use, patch.coordinates(use))
        if material.alpha_mode == "OPAQUE":
            colours[:, 3] = 1.0
        elif material.alpha_mode == "MASK":
            colours[:, 3] = colours[:, 3] >= material.alpha_cutoff
        return np.asarray(colours.clip(0, 1))

    def _note(self, fault: str) -> None:
        self._faults.setdefault(fault)

    @cached_property
    def _content(self) -> Content:
        return self._asset.content()

    @cached_property
    def _drawn(self) -> list[tuple[Draw, Material]]:
        materials = self._content.materials
        return [
            (draw, _DEFAULT if draw.material is None else materials[draw.material])
            for draw in self._content.draws
        ]

    @cached_property
    def _by_image(self) -> list[int]:
        """The draws, so that those with one image follow each other."""
        uses = [_texture(material) for _, material in self._drawn]
        images = [-1 if use is None or use.image is None else use.image for use in uses]
        return list(np.argsort(images, kind="stable"))

    @cached_property
    def _pictures(self) -> Mapping[int, Picture]:
        """The images that colours are read from, by their numbers."""
        uses = [_texture(material) for _, material in self._drawn]
        numbers = {use.image for use in uses if use is not None and use.image is not None}
        return {number: read_picture(self._content.images[number]) for number in numbers}

    @cached_property
    def _places(self) -> tuple[Ints, Ints]:
        """For each triangle of the file, the draw it is in and its row there."""
        owners = np.zeros(len(self._asset.triangles), dtype=np.int64)
        places = np.zeros_like(owners)
        for number, (draw, _) in enumerate(self._drawn):
            owners[draw.rows] = number
            places[draw.rows] = np.arange(len(draw.rows))
        return owners, places


def _texture(material: Material) -> TextureUse | None:
    return next(filter(None, map(material.texture, _SLOTS)), None)


@dataclass(frozen=True)
class _Patch:
    """Points on the triangles of one draw: rows of them, and (k, 3) barycentric coordinates."""

    draw: Draw
    rows: Ints
    weights: Floats

    def vertex_colours(self) -> Floats:
        """(k, 4) what the vertices' colours multiply with, 1 where there are none."""
        found = np.ones((len(self.weights), 4))
        values = self._values("COLOR_0")
        if values is not None:
            channels = min(values.shape[1], 4)
            found[:, :channels] = values[:, :channels]
        return np.where(np.isfinite(found), found, 1.0)

    def coordinates(self, use: TextureUse) -> Floats:
        """(k, 2) where a texture is read; viewers take (0, 0) where a mesh has no coordinates."""
        values = self._values(f"TEXCOORD_{use.uv_set}")
        if values is None:
            values = np.zeros((len(self.weights), 2))
        with np.errstate(over="ignore", invalid="ignore"):
            return placed(use, values)

    def _values(self, name: str) -> Floats | None:
        attribute = self.draw.attributes.get(name)
        if attribute is None:
            return None
        rows = attribute.corners[self.rows].ravel()
        values = attribute.read(np.maximum(rows, 0))
        values[rows < 0] = np.nan
        corners = values.reshape(len(self.rows), 3, -1)
        with np.errstate(over="ignore", invalid="ignore"):
            return np.asarray(np.einsum("kc,kcd->kd", self.weights, corners))


class _Images:
    """The pixels of images: of small ones all, of large ones the last."""

    def __init__(
        self,
        pictures: Mapping[int, Picture],
        decoder: PictureDecoder,
        decoded: dict[int, NDArray[np.uint8]],
    ) -> None:
        self._pictures = pictures
        self._decoder = decoder
        self._decoded = decoded
        self._texels = sum(each.texels or 0 for each in pictures.values())
        self._faults: dict[int, str] = {}

    def let_go(self) -> None:
        """Forget what was decoded, where it is too large to be kept."""
        if self._texels > _KEPT_TEXELS:
            self._decoded.clear()

    def pixels(self, number: int | None) -> NDArray[np.uint8]:
        """(h, w, 4) of an image; asked for twice in a row, it is decoded once.

        Raises:
            UndecodableError: why they cannot be had.
        """
        if number is None:
            raise UndecodableError("a texture names no image that is known")
        if self._texels > _MOST_TEXELS:
            raise UndecodableError(
                f"its textures together have more than the {_MOST_TEXELS:,} texels decoded here"
            )
        if number in self._faults:
            raise UndecodableError(self._faults[number])
        if number not in self._decoded:
            self.let_go()
            picture = self._pictures[number]
            try:
                self._decoded[number] = self._decoder.pixels(picture)
            except UndecodableError as error:
                self._faults[number] = f"image '{picture.name}': {error}"
                raise UndecodableError(self._faults[number]) from None
        return self._decoded[number]
