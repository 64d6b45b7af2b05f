"""The images of an asset and how its materials use them."""

from __future__ import annotations

from pydantic import Field

from meshcone.auditing.records.section import Section
from meshcone.picture_formats import PictureFormat


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

    count: int = Field(description="images that the file has or names")
    names: tuple[str, ...] = Field(description="of the images")
    formats: tuple[PictureFormat, ...] = Field(description="each that occurs, once")
    missing: int = Field(
        description="images that were not sent or cannot be had, and uses of textures by materials "
        "that lead to none"
    )
    unreadable: int | None = Field(
        description="images that are damaged or of an unknown format; null where one other than a "
        "KTX2, of which headers and lengths are looked at, was not decoded"
    )
    not_tested: int = Field(description="images whose pixels were not decoded")
    not_power_of_two: int | None = Field(
        description="images with a side that is no power of two; null where the size of one could "
        "not be read"
    )
    not_square: int | None = Field(
        description="images that are wider or higher; null where the size of one could not be read"
    )
    largest_width: int | None = Field(
        description="texels of the widest; null where the size of one could not be "
        "read, 0 without any"
    )
    largest_height: int | None = Field(
        description="texels of the highest; null where the size of one could not be "
        "read, 0 without any"
    )
    smallest_width: int | None = Field(
        description="texels of the narrowest; null where the size of one could not be "
        "read, 0 without any"
    )
    smallest_height: int | None = Field(
        description="texels of the lowest; null where the size of one could not be "
        "read, 0 without any"
    )
    duplicates: int = Field(description="images with the bytes of an earlier one")
    unused: int = Field(description="images that no material uses")
    wrong_color_space: int | None = Field(
        description="images bound both as colour and as data, or as a normal map that no normals "
        "are in; what reads alpha alone agrees with both; null where a normal map was not decoded"
    )
    base_color_luminance_min: float | None = Field(
        description="least 1st percentile of the luminance of a base colour, 0 to 255; null "
        "where one was not decoded, and without any"
    )
    base_color_luminance_max: float | None = Field(
        description="greatest 99th percentile of the luminance of a base colour, 0 to 255; null "
        "where one was not decoded, and without any"
    )
    unused_alpha: int | None = Field(
        description="base colours with transparent texels in materials that are all opaque; null "
        "where one of such a material was not decoded"
    )
    images: tuple[ImageRecord, ...]
