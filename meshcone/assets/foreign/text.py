"""Lines and numbers of text formats, each number with the line to blame."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.foreign.polygons import check_positions
from meshcone.assets.limits import Limits
from meshcone.errors import InputError

_NUMBER = re.compile(rb"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[+-]?(?:nan|inf(?:inity)?)", re.I)
_INTEGER = re.compile(rb"[+-]?\d{1,18}")

_BLOCK_BYTES = 1024 * 1024

Line = tuple[int, bytes]


def content_lines(
    data: bytes, limits: Limits, first: int = 1, comment: bytes = b""
) -> Iterator[Line]:
    """Iterate over lines that hold something besides blanks and comments, with their numbers.

    Args:
        data: the text.
        limits: of which ``lines`` counts.
        first: number of its first line.
        comment: what starts a comment; empty if the format has none.

    Raises:
        LimitError: more lines than ``limits`` accept.
    """
    count = data.count(b"\n") + data.count(b"\r") - data.count(b"\r\n") + 1
    limits.check("lines", count, "lines")
    return (
        (number, text)
        for number, line in enumerate(_lines(data), first)
        if (text := (line.partition(comment)[0] if comment else line).strip())
    )


def _lines(data: bytes) -> Iterator[bytes]:
    """What ``splitlines`` has, a block at a time: an object for each takes 30 times its bytes."""
    start = 0
    while start < len(data):
        end = start + _BLOCK_BYTES
        if end < len(data):
            end = max(data.rfind(b"\n", start, end), data.rfind(b"\r", start, end - 1)) + 1
            if end <= start:  # a line that is longer than a block
                end = data.find(b"\n", start) + 1 or len(data)
        yield from data[start:end].splitlines()
        start = end


def take(lines: Iterator[Line], count: int, what: str) -> list[Line]:
    """The next lines.

    Raises:
        InputError: there are fewer.
    """
    taken = list(islice(lines, count))
    if len(taken) < count:
        place = f"line {taken[-1][0]}" if taken else "end of the file"
        raise InputError(f"expected {count:,} {what}, found {len(taken):,}", place=place)
    return taken


def points(lines: Sequence[Line], columns: Sequence[int] = (0, 1, 2)) -> NDArray[np.float64]:
    """(k, 3) coordinates that stand in certain columns of lines.

    Raises:
        InputError: naming the line of the first that is missing, no number or too large.
    """
    positions = np.empty((len(lines), 3))
    last = max(columns)
    first, second, third = columns
    for row, (number, text) in enumerate(lines):
        words = text.split(None, last + 1)
        if len(words) <= last:
            raise InputError(
                f"expected {last + 1} numbers, found {len(words)}", place=f"line {number}"
            )
        try:
            positions[row] = float(words[first]), float(words[second]), float(words[third])
        except ValueError:
            for column in columns:
                decimal(words[column], number)
        if b"_" in text:  # which Python reads as a separator of digits
            positions[row] = [decimal(words[column], number) for column in columns]
    check_positions(positions, lambda row: f"line {lines[row][0]}")
    return positions


def decimal(word: bytes, line: int) -> float:
    """A number.

    Raises:
        InputError: the word is none.
    """
    if _NUMBER.fullmatch(word) is None:
        raise InputError(f"expected a number, found '{shown(word)}'", place=f"line {line}")
    return float(word)


def integer(word: bytes, line: int, what: str) -> int:
    """A whole number.

    Raises:
        InputError: the word is none.
    """
    if _INTEGER.fullmatch(word) is None:
        raise InputError(f"expected {what}, found '{shown(word)}'", place=f"line {line}")
    return int(word)


def shown(word: bytes) -> str:
    """A word of the file, made safe to quote in a message."""
    text = word[:60].decode("utf-8", "replace")
    return text if len(text) <= 40 else text[:39] + "…"
