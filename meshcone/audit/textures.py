"""The images of an asset and how its materials use them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from meshcone.assets.content import Content
from meshcone.assets.pictures import (
    Picture,
    PictureDecoder,
    PictureFormat,
    UndecodableError,
    grouped_by_content,
)
from meshcone.audit.records import Section
from meshcone.audit.subject import Subject

_COLOR_SLOTS = ("base_color", "emissive", "diffuse", "specularColor", "sheenColor")
_LUMINANCE = (0.2126, 0.7152, 0.0722)  # Rec. 709, of values as encoded, as artists read them
_LEAST_OF_NORMALS = 0.5  # mean blue of a normal map that points outwards


class ImageRecord(Section):
    """One image."""

    name: str
    format: PictureFormat
    width: int | None
    height: int | None
    bytes: int
    sha256: str | None
    used_as: tuple[str, ...] = Field(description="slots of materials that it is bound to")
    power_of_two: bool | None
    square: bool | None
    fault: str | None = Field(description="why it cannot be read, if it cannot")
    luminance_mean: float | None = Field(
        description="of a base colour, 0 to 255 as encoded; null for others and where it was not "
        "decoded"
    )
    luminance_p1: float | None = Field(description="1st percentile of the same")
    luminance_p99: float | None = Field(description="99th percentile of the same")
    alpha_used: bool | None = Field(
        description="whether any texel is not opaque; null where it was not decoded"
    )


class Textures(Section):
    """All images together, and each of them."""

    count: int
    missing: int = Field(description="images that were not sent or cannot be had")
    unreadable: int = Field(description="images that are damaged or of an unknown format")
    not_tested: int = Field(description="images whose pixels were not decoded")
    not_power_of_two: int
    not_square: int
    largest_width: int
    largest_height: int
    smallest_width: int
    smallest_height: int
    duplicates: int = Field(description="images with the bytes of an earlier one")
    unused: int = Field(description="images that no material uses")
    wrong_color_space: int = Field(
        description="images bound both as colour and as data, or as a normal map that no normals "
        "are in"
    )
    base_color_luminance_min: float | None = Field(
        description="least 1st percentile of the luminance of a base colour, 0 to 255"
    )
    base_color_luminance_max: float | None = Field(
        description="greatest 99th percentile of the luminance of a base colour, 0 to 255"
    )
    unused_alpha: int = Field(
        description="base colours with transparent texels in materials that are all opaque"
    )
    images: tuple[ImageRecord, ...]

    @classmethod
    def of(cls, subject: Subject, pictures: tuple[Picture, ...]) -> Self:
        """Look at every image; the pixels of those that materials use are decoded."""
        uses = _uses(subject.content)
        with PictureDecoder() as decoder:
            looks = [
                _Look.at(picture, uses.get(number, ()), decoder)
                for number, picture in enumerate(pictures)
            ]
        records = tuple(map(_record, looks))
        sized = [each for each in records if each.width is not None and each.height is not None]
        widths = [each.width or 0 for each in sized]
        heights = [each.height or 0 for each in sized]
        return cls(
            count=len(records),
            missing=sum(picture.fault == "missing" for picture in pictures),
            unreadable=sum(picture.fault not in (None, "missing") for picture in pictures),
            not_tested=sum(look.not_tested for look in looks),
            not_power_of_two=sum(each.power_of_two is False for each in records),
            not_square=sum(each.square is False for each in records),
            largest_width=max(widths, default=0),
            largest_height=max(heights, default=0),
            smallest_width=min(widths, default=0),
            smallest_height=min(heights, default=0),
            duplicates=sum(len(group) - 1 for group in grouped_by_content(pictures)),
            unused=sum(not each.used_as for each in records),
            wrong_color_space=sum(look.wrong_color_space for look in looks),
            base_color_luminance_min=_least(each.luminance_p1 for each in records),
            base_color_luminance_max=_greatest(each.luminance_p99 for each in records),
            unused_alpha=sum(map(_wastes_alpha, _owners(subject.content), looks)),
            images=records,
        )


class _Look:
    """What was found of one image."""

    def __init__(self, picture: Picture, slots: tuple[str, ...]) -> None:
        self.picture = picture
        self.slots = slots
        self.alpha_used: bool | None = None
        self.luminance: tuple[float, float, float] | None = None
        self.not_tested = False
        self.holds_normals: bool | None = None

    @classmethod
    def at(cls, picture: Picture, slots: tuple[str, ...], decoder: PictureDecoder) -> Self:
        look = cls(picture, slots)
        if not slots or picture.fault is not None:
            return look
        try:
            pixels = decoder.pixels(picture)
        except UndecodableError:
            look.not_tested = True
            return look
        look.alpha_used = bool((pixels[..., 3] < 255).any())
        if "base_color" in slots:
            look.luminance = _luminance(pixels)
        if "normal" in slots:
            look.holds_normals = bool(pixels[..., 2].mean() / 255 > _LEAST_OF_NORMALS)
        return look

    @property
    def wrong_color_space(self) -> bool:
        as_color = {slot.startswith(_COLOR_SLOTS) for slot in self.slots}
        return len(as_color) > 1 or self.holds_normals is False


def _uses(content: Content) -> Mapping[int, tuple[str, ...]]:
    found: dict[int, dict[str, None]] = {}
    for material in content.materials:
        for use in material.textures:
            if use.image is not None:
                found.setdefault(use.image, {}).setdefault(use.slot.rpartition(".")[2])
    return {image: tuple(slots) for image, slots in found.items()}


def _owners(content: Content) -> Iterator[set[str]]:
    """The alpha modes of the materials each image is the base colour of."""
    modes: list[set[str]] = [set() for _ in content.images]
    for material in content.materials:
        use = material.texture("base_color")
        if use is not None and use.image is not None:
            modes[use.image].add(material.alpha_mode)
    return iter(modes)


def _wastes_alpha(modes: set[str], look: _Look) -> bool:
    return look.alpha_used is True and modes == {"OPAQUE"}


def _luminance(pixels: NDArray[np.uint8]) -> tuple[float, float, float]:
    """Mean, 1st and 99th percentile of what is not transparent, from a histogram."""
    shown = pixels[pixels[..., 3] > 0][:, :3]
    if len(shown) == 0:
        return 0.0, 0.0, 0.0
    values = np.rint(shown @ np.array(_LUMINANCE)).astype(np.int64)
    counts = np.bincount(values, minlength=256)
    shares = np.cumsum(counts) / counts.sum()
    low, high = np.searchsorted(shares, (0.01, 0.99))
    return float((counts * np.arange(len(counts))).sum() / counts.sum()), float(low), float(high)


def _record(look: _Look) -> ImageRecord:
    picture = look.picture
    width, height = picture.width, picture.height
    mean, low, high = look.luminance or (None, None, None)
    known = width is not None and height is not None
    return ImageRecord(
        name=picture.name,
        format=picture.format,
        width=width,
        height=height,
        bytes=len(picture.image.data or b""),
        sha256=picture.sha256,
        used_as=look.slots,
        power_of_two=_is_power(width or 0) and _is_power(height or 0) if known else None,
        square=width == height if known else None,
        fault=picture.fault,
        luminance_mean=mean,
        luminance_p1=low,
        luminance_p99=high,
        alpha_used=look.alpha_used,
    )


def _is_power(number: int) -> bool:
    return number > 0 and number & (number - 1) == 0


def _least(values: Iterator[float | None]) -> float | None:
    return min((value for value in values if value is not None), default=None)


def _greatest(values: Iterator[float | None]) -> float | None:
    return max((value for value in values if value is not None), default=None)
