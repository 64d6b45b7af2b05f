"""Sorts the lines of an OBJ file by what they state.

Source: "Object Files (.obj)", Wavefront Advanced Visualizer, appendix B1. Only the
statements a surface needs are told apart; everything else is carried as text.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_BYTE_ORDER_MARK = b"\xef\xbb\xbf"
_PADDING = 16  # lets every statement be compared with any keyword
_BLANKS: NDArray[np.bool_] = np.isin(np.arange(256), list(b" \t\n\r\v\f"))


@dataclass(frozen=True)
class ObjLines:
    """An OBJ file as statements.

    Attributes:
        raw: one entry per statement with its line ends; joined, they are the file.
        text: the same statements with line continuations turned into blanks.
        first_lines: 1-based number of each statement's first line in the file.
        vertices, normals, faces: rows of ``raw`` that hold v, vn and f.
        objects, groups, materials: rows that hold o, g and usemtl.
    """

    raw: list[bytes]
    text: list[bytes]
    first_lines: range | NDArray[np.int64]
    vertices: NDArray[np.int64]
    normals: NDArray[np.int64]
    faces: NDArray[np.int64]
    objects: NDArray[np.int64]
    groups: NDArray[np.int64]
    materials: NDArray[np.int64]

    def place(self, row: int) -> str:
        """Where a statement stands in the file, for messages."""
        return f"line {self.first_lines[row]}"

    def statement(self, row: int) -> bytes:
        """A statement without its comment."""
        line = self.text[row]
        return line.partition(b"#")[0] if b"#" in line else line

    def leading_words(self, row: int, count: int) -> list[bytes]:
        """A statement's keyword and first arguments, at most ``count`` words in all."""
        return self.statement(row).split(None, count)[:count]

    def names(self, rows: NDArray[np.int64]) -> list[str]:
        """What each of some o, g or usemtl statements names."""
        arguments = (self.statement(row).split(None, 1)[1:] for row in rows.tolist())
        return [b"".join(name).rstrip().decode("utf-8", "replace") for name in arguments]


def count_lines(data: bytes) -> int:
    """Lines of a text, counted before it is cut into them; one more than its line ends."""
    return data.count(b"\n") + data.count(b"\r") - data.count(b"\r\n") + 1


def count_words(text: bytes) -> int:
    """Words of a text, counted before it is cut into them."""
    blank = _BLANKS[np.frombuffer(text, dtype=np.uint8)]
    if len(blank) == 0:
        return 0
    return int(np.count_nonzero(blank[:-1] & ~blank[1:])) + int(not blank[0])


def scan_lines(data: bytes) -> ObjLines:
    """Sort a file's statements by keyword, in one pass."""
    raw = data.splitlines(keepends=True)
    first_lines: range | NDArray[np.int64] = range(1, len(raw) + 1)
    text = raw
    if b"\\\n" in data or b"\\\r" in data:
        raw, first_lines = _join_continued(raw)
        text = [_without_continuations(statement) for statement in raw]
    if data.startswith(_BYTE_ORDER_MARK):
        text = [text[0].removeprefix(_BYTE_ORDER_MARK), *text[1:]]

    keywords = _Keywords(text)
    return ObjLines(
        raw=raw,
        text=text,
        first_lines=first_lines,
        vertices=keywords.rows(b"v"),
        normals=keywords.rows(b"vn"),
        faces=keywords.rows(b"f"),
        objects=keywords.rows(b"o"),
        groups=keywords.rows(b"g"),
        materials=keywords.rows(b"usemtl"),
    )


class _Keywords:
    """Finds statements by keyword with array operations: files have millions of them."""

    def __init__(self, text: list[bytes]) -> None:
        lengths = np.fromiter(map(len, text), dtype=np.int64, count=len(text))
        self._starts = np.cumsum(lengths) - lengths
        self._characters = np.frombuffer(b"".join([*text, b"\n" * _PADDING]), dtype=np.uint8)
        indented = np.flatnonzero(_BLANKS[self._characters[self._starts]])
        end = len(self._characters) - _PADDING
        for row in indented.tolist():
            words = text[row].lstrip()
            self._starts[row] = self._starts[row] + len(text[row]) - len(words) if words else end

    def rows(self, keyword: bytes) -> NDArray[np.int64]:
        """(k,) statements whose first word is the keyword."""
        found = np.arange(len(self._starts))
        for offset, character in enumerate(keyword):
            found = found[self._characters[self._starts[found] + offset] == character]
        ends = _BLANKS[self._characters[self._starts[found] + len(keyword)]]
        named: NDArray[np.int64] = found[ends]
        return named


def _join_continued(lines: list[bytes]) -> tuple[list[bytes], NDArray[np.int64]]:
    statements = list(_statements(lines))
    counts = [len(parts) for parts in statements]
    first_lines = np.cumsum([1, *counts[:-1]], dtype=np.int64)
    return [b"".join(parts) for parts in statements], first_lines


def _statements(lines: list[bytes]) -> Iterator[list[bytes]]:
    """Runs of lines joined by a backslash; a comment ends with its line."""
    parts: list[bytes] = []
    for line in lines:
        parts.append(line)
        if b"#" in line or not line.rstrip(b"\r\n").endswith(b"\\"):
            yield parts
            parts = []
    if parts:
        yield parts


def _without_continuations(statement: bytes) -> bytes:
    if b"\\" not in statement:
        return statement
    for line_end in (b"\\\r\n", b"\\\n", b"\\\r"):
        statement = statement.replace(line_end, b" ")
    return statement
