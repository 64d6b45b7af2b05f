"""The header of a KTX2 image, and whether all that it says is there is there."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from typing import NamedTuple

IDENTIFIER = b"\xabKTX 20\xbb\r\n\x1a\n"

# KTX File Format 2.0, section 3: numbers of images, then where descriptions lie, then the levels.
_NUMBERS = struct.Struct("<9I")
_DESCRIPTIONS = struct.Struct("<4I2Q")
_LEVEL = struct.Struct("<3Q")
_LEVELS_AT = len(IDENTIFIER) + _NUMBERS.size + _DESCRIPTIONS.size


class Ktx2(NamedTuple):
    """Width and height in texels, None where they could not be read; and what is wrong, if any."""

    width: int | None
    height: int | None
    fault: str | None


def read(data: bytes) -> Ktx2:
    """Read a header, and hold what it refers to against the length of the file."""
    if len(data) < _LEVELS_AT:
        return Ktx2(None, None, f"damaged: its header of {_LEVELS_AT} bytes is cut short")
    _, _, width, height, depth, _, _, levels, _ = _NUMBERS.unpack_from(data, len(IDENTIFIER))
    height = max(height, 1)
    if width == 0:
        return Ktx2(None, None, "damaged: its header says that it has no texels")
    if levels > max(width, height, depth).bit_length():
        return Ktx2(width, height, f"damaged: {levels:,} levels are more than its size has")
    for what, start, length in _ranges(data, max(levels, 1)):
        if start + length > len(data):
            return Ktx2(
                width,
                height,
                f"damaged: {what} ends at byte {start + length:,}; the file has {len(data):,}",
            )
    return Ktx2(width, height, None)


def _ranges(data: bytes, levels: int) -> Iterator[tuple[str, int, int]]:
    """What the file holds: what it is, where it starts and how many bytes it has."""
    yield "its list of levels", _LEVELS_AT, levels * _LEVEL.size
    found = _DESCRIPTIONS.unpack_from(data, _LEVELS_AT - _DESCRIPTIONS.size)
    for number, what in enumerate(("format", "key and value", "supercompression")):
        yield f"its {what} data", found[2 * number], found[2 * number + 1]
    for level in range(levels):
        start, length, _ = _LEVEL.unpack_from(data, _LEVELS_AT + level * _LEVEL.size)
        yield f"level {level}", start, length
