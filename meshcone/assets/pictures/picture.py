"""The images of an asset, as their headers describe them."""

from __future__ import annotations

import hashlib
import io
import struct
import threading
import warnings
from collections.abc import Iterator
from dataclasses import dataclass

from PIL import Image as Pillow
from PIL import UnidentifiedImageError

from meshcone.assets.content import Image
from meshcone.assets.pictures import ktx2
from meshcone.picture_formats import PictureFormat

MOST_TEXELS = 8192 * 8192
"""Of one image that is decoded: 256 MiB as RGBA."""

_FORMATS: dict[str, PictureFormat] = {"PNG": "png", "JPEG": "jpeg", "WEBP": "webp"}


class UndecodableError(Exception):
    """The pixels of an image cannot be had; the message says why.

    Attributes:
        damaged: whether that is the image's own fault, so that nobody can show it.
    """

    def __init__(self, message: str, *, damaged: bool = False) -> None:
        super().__init__(message)
        self.damaged = damaged


@dataclass(frozen=True)
class Picture:
    """What the header of an image says.

    Attributes:
        image: as the file holds it.
        format: by its content.
        width, height: texels; None where they could not be read.
        sha256: of its bytes; None where it was not sent.
        fault: why it cannot be read, if it cannot.
    """

    image: Image
    format: PictureFormat
    width: int | None = None
    height: int | None = None
    sha256: str | None = None
    fault: str | None = None

    @property
    def name(self) -> str:
        """What messages call it."""
        return self.image.name or self.image.place

    @property
    def texels(self) -> int | None:
        """How many it has."""
        return None if self.width is None or self.height is None else self.width * self.height


def read_picture(image: Image) -> Picture:
    """Read the header of an image."""
    data = image.data
    if data is None:
        return Picture(image, "unknown", fault="missing")
    digest = hashlib.sha256(data).hexdigest()
    if data.startswith(ktx2.IDENTIFIER):
        found = ktx2.read(data)
        return Picture(image, "ktx2", found.width, found.height, digest, found.fault)
    try:
        with _opened(data) as opened:
            kind = _FORMATS[opened.format or ""]
            return Picture(image, kind, opened.width, opened.height, digest)
    except UnidentifiedImageError:
        return Picture(image, "unknown", sha256=digest, fault="it is no PNG, JPEG, WebP or KTX2")
    except _PILLOW_ERRORS as error:
        return Picture(image, "unknown", sha256=digest, fault=f"damaged: {error}")


# What Pillow raises over damaged files, by experience: its plugins do not agree on one.
_PILLOW_ERRORS = (
    OSError,
    ValueError,
    SyntaxError,
    struct.error,
    EOFError,
    IndexError,
    KeyError,
    OverflowError,
)
# Pillow's cap on texels is a setting of the whole process, and refuses to read the header of an
# image whose pixels nobody asks for.
_UNCAPPED = threading.Lock()


def _opened(data: bytes) -> Pillow.Image:
    with _UNCAPPED, warnings.catch_warnings():
        most, Pillow.MAX_IMAGE_PIXELS = Pillow.MAX_IMAGE_PIXELS, None
        try:
            return Pillow.open(io.BytesIO(data), formats=tuple(_FORMATS))
        finally:
            Pillow.MAX_IMAGE_PIXELS = most


def grouped_by_content(pictures: tuple[Picture, ...]) -> Iterator[list[int]]:
    """Numbers of images that have the same bytes, two or more of them."""
    groups: dict[str, list[int]] = {}
    for number, picture in enumerate(pictures):
        if picture.sha256 is not None:
            groups.setdefault(picture.sha256, []).append(number)
    return (group for group in groups.values() if len(group) > 1)
