"""Lines and numbers of text formats, each number with the line to blame."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.comments import NO_NUMBER, uncommented
from meshcone.assets.foreign.polygons import check_positions
from meshcone.assets.limits import Limits
from meshcone.errors import InputError

_NUMBER = re.compile(rb"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[+-]?(?:nan|inf(?:inity)?)", re.I)
_INTEGER = re.compile(rb"[+-]?\d{1,18}")

_BLOCK_BYTES = 1024 * 1024

Line = tuple[int, bytes]


def content_lines(
    data: bytes, limits: Limits, first: int = 1, *, comments: bool = False
) -> Iterator[Line]:
    """Iterate over lines that hold something besides blanks and comments, with their numbers.

    Args:
        data: the text.
        limits: of which ``lines`` counts.
        first: number of its first line.
        comments: whether ``#`` starts one.

    Raises:
        LimitError: more lines than ``limits`` accept.
    """
    count = data.count(b"\n") + data.count(b"\r") - data.count(b"\r\n") + 1
    limits.check("lines", count, "lines")
    return (
        (number, text)
        for number, line in enumerate(_lines(data), first)
        if (text := (uncommented(line) if comments else line).strip())
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


def take(lines: Iterator[Line], count: int, what: str, words: int = 1) -> list[Line]:
    """The next lines, each with those after it that its first ``words`` words are wrapped over.

    Raises:
        InputError: there are fewer.
    """
    taken = []
    for number, text in islice(lines, count):
        if words > 1 and len(text.split(None, words - 1)) < words:
            taken.append((number, b" ".join(words_of((number, text), lines, words))))
        else:
            taken.append((number, text))
    require(count, what, [number for number, _ in taken])
    return taken


def require(count: int, what: str, found: Sequence[int]) -> None:
    """Compare how many were promised with the lines they were found in.

    Raises:
        InputError: there are fewer.
    """
    if len(found) < count:
        place = f"line {found[-1]}" if found else "end of the file"
        raise InputError(f"expected {count:,} {what}, found {len(found):,}", place=place)


def words_of(line: Line, following: Iterator[Line], count: int) -> list[bytes]:
    """The first words of a line, and of those after it where it has fewer; fewer at the end."""
    words = line[1].split(None, count)[:count]
    while len(words) < count and (further := next(following, None)):
        missing = count - len(words)
        words += further[1].split(None, missing)[:missing]
    return words


def points(lines: Sequence[Line], columns: Sequence[int] = (0, 1, 2)) -> NDArray[np.float64]:
    """(k, 3) coordinates that stand in certain columns of lines.

    Raises:
        InputError: naming the line of the first that is missing, no word for a number or too large.
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


def columns_of(lines: Sequence[Line], columns: Sequence[int]) -> NDArray[np.float64]:
    """(k, c) numbers that stand in certain columns of lines; NaN where one has none."""
    found = np.full((len(lines), len(columns)), np.nan)
    for row, (_, text) in enumerate(lines):
        words = text.split()
        try:
            found[row] = [float(words[column]) for column in columns]
        except (IndexError, ValueError):
            found[row] = [number_or_nan(*words[column : column + 1]) for column in columns]
    return found


def number_or_nan(word: bytes = b"") -> float:
    """A number; NaN where a word is none."""
    return float(word) if _NUMBER.fullmatch(word) is not None else np.nan


def decimal(word: bytes, line: int) -> float:
    """A number.

    Raises:
        InputError: the word is none.
    """
    if _NUMBER.fullmatch(word) is None:
        expected = "a finite number" if NO_NUMBER.fullmatch(word) else "a number"
        raise InputError(f"expected {expected}, found '{shown(word)}'", place=f"line {line}")
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
