"""Reads the numbers of OBJ statements: whole blocks at once, one by one to explain an error."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.limits import LARGEST_COORDINATE
from meshcone.assets.obj.scan import ObjLines
from meshcone.errors import InputError

_BLOCK = 65_536
_BLOCK_BYTES = 8 * 1024 * 1024
_COLORED = 7  # words of a v statement with a colour, the keyword among them
_NUMBER = re.compile(rb"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")


def blocks(rows: NDArray[np.int64]) -> Iterator[NDArray[np.int64]]:
    """Rows in runs: few enough that the words of lines of usual length fit in memory together."""
    for start in range(0, len(rows), _BLOCK):
        yield rows[start : start + _BLOCK]


def block_words(lines: ObjLines, rows: NDArray[np.int64]) -> list[bytes] | None:
    """All words of a block of statements in a row.

    None if comments stand between them, or if they are too long to be cut all at once.
    """
    joined = lines.joined(rows, _BLOCK_BYTES)
    return None if joined is None or b"#" in joined else joined.split()


def read_positions(lines: ObjLines) -> NDArray[np.float64]:
    """(r, 3) coordinates of the v statements; weights and colours after them are not read.

    Raises:
        InputError: naming the line of the first coordinate that is missing, no number or
            beyond ``LARGEST_COORDINATE``.
    """
    return _read_vectors(lines, lines.vertices, _explain_position)


def read_normals(lines: ObjLines) -> NDArray[np.float64]:
    """(s, 3) values of the vn statements, NaN in all of a statement that is malformed.

    Broken normals are common and no reason to refuse a file: they are left as they are.
    """
    return _read_vectors(lines, lines.normals, _tolerated_normal)


def read_texcoords(lines: ObjLines) -> NDArray[np.float64]:
    """(t, 2) values of the vt statements, NaN in all of a statement that is malformed."""
    return _read_vectors(lines, lines.texcoords, _tolerated_texcoord, width=2)


def read_colors(lines: ObjLines) -> NDArray[np.float64]:
    """(r, 3) colours that follow the coordinates of the v statements, NaN where none does.

    They are no part of the format, but what scanners and sculpting programs write.
    """
    return _read_vectors(lines, lines.vertices, _tolerated_color, first=4)


def has_colors(lines: ObjLines) -> bool:
    """Whether the first of the v statements has a colour."""
    rows = lines.vertices
    return len(rows) > 0 and len(lines.leading_words(int(rows[0]), _COLORED)) == _COLORED


def parse_number(word: bytes) -> float | None:
    """A finite number; None if the word is none."""
    return float(word) if _NUMBER.fullmatch(word) and np.isfinite(float(word)) else None


def shown(word: bytes) -> str:
    """A word of the file, made safe to quote in a message."""
    text = word.decode("utf-8", "replace")
    return text if len(text) <= 40 else text[:39] + "…"


def _read_vectors(
    lines: ObjLines,
    rows: NDArray[np.int64],
    one_by_one: Callable[[ObjLines, int], tuple[float, ...]],
    first: int = 1,
    width: int = 3,
) -> NDArray[np.float64]:
    """(k, width) values of statements, which follow their ``first`` words."""
    vectors = np.empty((len(rows), width))
    filled = 0
    for block in blocks(rows):
        columns = range(first, first + width)
        values = _convert(block_words(lines, block), len(block), columns)
        if values is None:
            values = np.array([one_by_one(lines, row) for row in block.tolist()])
        vectors[filled : filled + len(block)] = values
        filled += len(block)
    return vectors


def _convert(words: list[bytes] | None, count: int, wanted: range) -> NDArray[np.float64] | None:
    """Columns of ``count`` statements of equal width, or None if they need a closer look."""
    width, rest = divmod(len(words), count) if words else (0, 0)
    if words is None or rest or width < wanted.stop:
        return None
    keyword = words[0]
    # As many keywords as statements, and all of them in the first column: no statement is shorter.
    if words[::width].count(keyword) != count or words.count(keyword) != count:
        return None
    # float() also reads digits grouped by underscores, which OBJ does not know.
    columns = [words[column::width] for column in wanted]
    if any(b"_" in b"".join(column) for column in columns):
        return None
    try:
        values = np.array([list(map(float, column)) for column in columns]).T
    except ValueError:
        return None
    return values if (np.abs(values) <= LARGEST_COORDINATE).all() else None


def _explain_position(lines: ObjLines, row: int) -> tuple[float, float, float]:
    words = lines.leading_words(row, 4)[1:]
    if len(words) < 3:
        raise InputError(
            f"a vertex needs 3 coordinates, found {len(words)}", place=lines.place(row)
        )
    x, y, z = (_finite(word, lines.place(row)) for word in words)
    return x, y, z


def _finite(word: bytes, place: str) -> float:
    value = float(word) if _NUMBER.fullmatch(word) else np.nan
    if abs(value) <= LARGEST_COORDINATE:
        return value
    expected = (
        "a finite number" if np.isnan(value) else f"a number of at most {LARGEST_COORDINATE:g}"
    )
    raise InputError(f"expected {expected}, found '{shown(word)}'", place=place)


def _tolerated_normal(lines: ObjLines, row: int) -> tuple[float, ...]:
    return _tolerated(lines.leading_words(row, 4)[1:], 3)


def _tolerated_texcoord(lines: ObjLines, row: int) -> tuple[float, ...]:
    words = lines.leading_words(row, 3)[1:]
    return _tolerated([*words, b"0"] if len(words) == 1 else words, 2)


def _tolerated_color(lines: ObjLines, row: int) -> tuple[float, ...]:
    return _tolerated(lines.leading_words(row, _COLORED)[4:], 3)


def _tolerated(words: list[bytes], count: int) -> tuple[float, ...]:
    broken = (np.nan,) * count
    if len(words) < count or not all(_NUMBER.fullmatch(word) for word in words):
        return broken
    values = tuple(map(float, words))
    return values if max(map(abs, values)) <= LARGEST_COORDINATE else broken
