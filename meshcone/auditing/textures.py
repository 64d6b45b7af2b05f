"""The images of an asset and how its materials use them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.content import Content, TextureUse
from meshcone.assets.pictures import (
    MOST_TEXELS,
    Picture,
    PictureDecoder,
    UndecodableError,
    grouped_by_content,
)
from meshcone.auditing.records.textures import ImageRecord, Textures
from meshcone.auditing.slots import BASE_COLOR, NORMALS, are_color_and_data
from meshcone.auditing.subject import Subject

Number = TypeVar("Number", int, float)

_LUMINANCE = (0.2126, 0.7152, 0.0722)  # Rec. 709, of values as encoded, as artists read them
_OPAQUE = 255
_ROWS = 256  # of an image, whose luminance is computed at once
_MOST_TEXELS = 4 * MOST_TEXELS  # of all images together, about 10 ns each
_LEAST_OF_NORMALS = 0.5  # mean blue of a normal map that points outwards


def textures_of(subject: Subject, pictures: tuple[Picture, ...]) -> Textures:
    """Look at every image; their pixels are decoded, as far as they are not too many."""
    uses = _uses(subject.content)
    with PictureDecoder() as decoder:
        looks = list(_looks(subject, pictures, decoder))
    records = tuple(
        _record(picture, uses.get(number, ()), look)
        for number, (picture, look) in enumerate(zip(pictures, looks, strict=True))
    )
    base_colors = [each for each in records if BASE_COLOR in each.used_as]
    widths, heights = [each.width for each in records], [each.height for each in records]
    return Textures(
        count=len(records),
        names=tuple(each.name for each in records),
        formats=tuple(dict.fromkeys(each.format for each in records)),
        missing=sum(picture.fault == "missing" for picture in pictures)
        + sum(use.image is None for each in subject.content.materials for use in each.textures),
        unreadable=_count(map(_is_unreadable, pictures, looks)),
        not_tested=sum(not look.tested for look in looks),
        not_power_of_two=_count(_not(each.power_of_two) for each in records),
        not_square=_count(_not(each.square) for each in records),
        largest_width=_side(widths, max),
        largest_height=_side(heights, max),
        smallest_width=_side(widths, min),
        smallest_height=_side(heights, min),
        duplicates=sum(len(group) - 1 for group in grouped_by_content(pictures)),
        unused=sum(not each.used_as for each in records),
        wrong_color_space=_count(
            _has_wrong_color_space(record.used_as, look)
            for record, look in zip(records, looks, strict=True)
        ),
        base_color_luminance_min=_least(each.luminance_p1 for each in base_colors),
        base_color_luminance_max=_greatest(each.luminance_p99 for each in base_colors),
        unused_alpha=_count(map(_wastes_alpha, _owners(subject.content), looks)),
        images=records,
    )


@dataclass(frozen=True)
class _Look:
    """What the pixels of one image say.

    Attributes:
        tested: whether they were decoded, if the image has any.
        fault: why nobody can decode them, if so.
        luminance: mean, 1st and 99th percentile of a base colour.
        holds_normals: of a normal map.
    """

    tested: bool = True
    fault: str | None = None
    alpha_used: bool | None = None
    luminance: tuple[float, float, float] | None = None
    holds_normals: bool | None = None


def _looks(
    subject: Subject, pictures: tuple[Picture, ...], decoder: PictureDecoder
) -> Iterator[_Look]:
    uses = _uses(subject.content)
    left = _MOST_TEXELS
    for number, picture in enumerate(pictures):
        slots = uses.get(number, ())
        if picture.fault is not None:
            yield _Look(fault=picture.fault)
            continue
        texels = picture.texels or 0
        if texels > min(left, MOST_TEXELS):
            yield _Look(tested=False)
            continue
        left -= texels
        yield subject.seen.once(
            ("look", picture.sha256, slots), partial(_look, picture, slots, decoder)
        )


def _look(picture: Picture, slots: tuple[str, ...], decoder: PictureDecoder) -> _Look:
    try:
        pixels = decoder.pixels(picture)
    except UndecodableError as error:
        return _Look(fault=str(error)) if error.damaged else _Look(tested=False)
    return _Look(
        alpha_used=bool((pixels[..., 3] < _OPAQUE).any()),
        luminance=_luminance(pixels) if BASE_COLOR in slots else None,
        holds_normals=bool(pixels[..., 2].mean() / _OPAQUE > _LEAST_OF_NORMALS)
        if not NORMALS.isdisjoint(slots)
        else None,
    )


def _is_unreadable(picture: Picture, look: _Look) -> bool | None:
    # A KTX2 is not decoded, but all that its header refers to is there.
    if not look.tested and picture.format != "ktx2":
        return None
    return look.fault is not None and picture.image.data is not None


def _has_wrong_color_space(slots: tuple[str, ...], look: _Look) -> bool | None:
    if are_color_and_data(slots):
        return True
    if NORMALS.isdisjoint(slots):
        return False
    return None if look.holds_normals is None else not look.holds_normals


def _uses(content: Content) -> Mapping[int, tuple[str, ...]]:
    found: dict[int, dict[str, None]] = {}
    for material in content.materials:
        for use in material.textures:
            for image in _images_of(use):
                found.setdefault(image, {}).setdefault(use.slot.rpartition(".")[2])
    return {image: tuple(slots) for image, slots in found.items()}


def _owners(content: Content) -> Iterator[set[str]]:
    """The alpha modes of the materials each image is the base colour of."""
    modes: list[set[str]] = [set() for _ in content.images]
    for material in content.materials:
        use = material.texture(BASE_COLOR)
        for image in _images_of(use) if use is not None else ():
            modes[image].add(material.alpha_mode)
    return iter(modes)


def _images_of(use: TextureUse) -> list[int]:
    """The image of a texture, and those for who can read them."""
    own = [] if use.image is None else [use.image]
    return own + [image for _, image in use.others]


def _wastes_alpha(modes: set[str], look: _Look) -> bool | None:
    return look.alpha_used if modes == {"OPAQUE"} else False


def _luminance(pixels: NDArray[np.uint8]) -> tuple[float, float, float]:
    """Mean, 1st and 99th percentile of what is not transparent, from a histogram."""
    counts = np.zeros(_OPAQUE + 1, dtype=np.int64)
    for rows in np.array_split(pixels, -(-len(pixels) // _ROWS)):
        shown = rows[rows[..., 3] > 0][:, :3]
        values = np.rint(shown @ np.array(_LUMINANCE)).astype(np.int64)
        counts += np.bincount(values, minlength=len(counts))
    if counts.sum() == 0:
        return 0.0, 0.0, 0.0
    shares = np.cumsum(counts) / counts.sum()
    low, high = np.searchsorted(shares, (0.01, 0.99))
    return float((counts * np.arange(len(counts))).sum() / counts.sum()), float(low), float(high)


def _record(picture: Picture, slots: tuple[str, ...], look: _Look) -> ImageRecord:
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
        used_as=slots,
        power_of_two=_is_power(width or 0) and _is_power(height or 0) if known else None,
        square=width == height if known else None,
        fault=look.fault,
        luminance_mean=mean,
        luminance_p1=low,
        luminance_p99=high,
        alpha_used=look.alpha_used,
    )


def _is_power(number: int) -> bool:
    return number > 0 and number & (number - 1) == 0


# An image whose pixels are not known could be the one that matters.


def _count(verdicts: Iterable[bool | None]) -> int | None:
    found = list(verdicts)
    return None if None in found else sum(map(bool, found))


def _not(verdict: bool | None) -> bool | None:
    return None if verdict is None else not verdict


def _side(values: Sequence[int | None], choose: Callable[[list[int]], int]) -> int | None:
    """The least or the greatest; 0 without any, None where one is not known."""
    known = _all_known(values)
    if len(known) < len(values):
        return None
    return choose(known) if known else 0


def _least(values: Iterable[float | None]) -> float | None:
    return min(_all_known(values), default=None)


def _greatest(values: Iterable[float | None]) -> float | None:
    return max(_all_known(values), default=None)


def _all_known(values: Iterable[Number | None]) -> list[Number]:
    """The values; none of them where one is not known."""
    found = list(values)
    known = [value for value in found if value is not None]
    return known if len(known) == len(found) else []
