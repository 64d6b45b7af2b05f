"""Sorts the lines of an OBJ file by what they state.

Source: "Object Files (.obj)", Wavefront Advanced Visualizer, appendix B1. Only the
statements a surface needs are told apart; everything else is carried as text.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.comments import uncommented
from meshcone.text import BYTE_ORDER_MARK

_PADDING = 16  # lets every statement be compared with any keyword
_BLANKS: NDArray[np.bool_] = np.isin(np.arange(256), list(b" \t\n\r\v\f"))
_NEWLINE, _RETURN, _HASH, _BLANK, _BACKSLASH = b"\n\r# \\"
_USUAL_INDENT = 64


@dataclass(frozen=True)
class ObjLines:
    """An OBJ file as statements.

    They are cut out of it when they are asked for: a file can have millions that say nothing,
    and an object for each takes fifty times its size.

    Attributes:
        data: the file.
        text: the same with line continuations and byte order mark turned into blanks.
        bounds: where each statement starts in both, and the end of the last.
        first_lines: 1-based number of each statement's first line in the file.
        vertices, normals, texcoords, faces: statements that are v, vn, vt and f.
        objects, groups, materials: statements that are o, g and usemtl.
        libraries: statements that are mtllib.
    """

    data: bytes
    text: bytes
    bounds: NDArray[np.int64]
    first_lines: range | NDArray[np.int64]
    vertices: NDArray[np.int64]
    normals: NDArray[np.int64]
    texcoords: NDArray[np.int64]
    faces: NDArray[np.int64]
    objects: NDArray[np.int64]
    groups: NDArray[np.int64]
    materials: NDArray[np.int64]
    libraries: NDArray[np.int64]

    def place(self, row: int) -> str:
        """Where a statement stands in the file, for messages."""
        return f"line {self.first_lines[row]}"

    def raw(self, row: int) -> bytes:
        """A statement as it stands in the file, with its line ends."""
        return self.data[self.bounds[row] : self.bounds[row + 1]]

    def joined(self, rows: NDArray[np.int64], most: int) -> bytes | None:
        """The text of some statements in a row; None if it has more than ``most`` bytes."""
        starts, ends = self.bounds[rows], self.bounds[rows + 1]
        if len(rows) == 0 or (ends - starts).sum() > most:
            return b"" if len(rows) == 0 else None
        if rows[-1] - rows[0] == len(rows) - 1:
            return self.text[starts[0] : ends[-1]]
        pairs = zip(starts.tolist(), ends.tolist(), strict=True)
        return b"".join([self.text[start:end] for start, end in pairs])

    def statement(self, row: int) -> bytes:
        """A statement without its comment."""
        line = self.text[self.bounds[row] : self.bounds[row + 1]]
        return uncommented(line)

    def leading_words(self, row: int, count: int) -> list[bytes]:
        """A statement's keyword and first arguments, at most ``count`` words in all."""
        return self.statement(row).split(None, count)[:count]

    def names(self, rows: NDArray[np.int64]) -> list[str]:
        """What each of some o, g, usemtl or mtllib statements names.

        Names keep their number signs, as viewers have it: exporters write ``Material #25``.
        """
        bounds = zip(self.bounds[rows].tolist(), self.bounds[rows + 1].tolist(), strict=True)
        arguments = (self.text[start:end].split(None, 1)[1:] for start, end in bounds)
        return [b"".join(name).rstrip().decode("utf-8", "replace") for name in arguments]

    def named(self, *keywords: bytes) -> list[NDArray[np.int64]]:
        """The statements whose first word is each of some keywords."""
        found = _Keywords(self.text, self.bounds)
        return [found.rows(keyword) for keyword in keywords]

    def holding(self, character: bytes) -> NDArray[np.int64]:
        """The statements that have a character, in their comments or elsewhere."""
        places = np.flatnonzero(np.frombuffer(self.text, dtype=np.uint8) == ord(character))
        return np.unique(np.searchsorted(self.bounds, places, side="right") - 1)

    def replaced(self, statements: Mapping[int, bytes]) -> bytes:
        """The file with other statements in some rows."""
        pieces, done = [], 0
        for row in sorted(statements):
            pieces += [self.data[done : self.bounds[row]], statements[row]]
            done = int(self.bounds[row + 1])
        return b"".join([*pieces, self.data[done:]])


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
    """Sort a file's statements by keyword, with array operations: files have millions of them."""
    bounds = _line_bounds(data)
    first_lines: range | NDArray[np.int64] = range(1, len(bounds))
    text = data
    if b"\\\n" in data or b"\\\r" in data:
        bounds, first_lines, text = _join_continued(data, bounds)
    if text.startswith(BYTE_ORDER_MARK):
        text = b" " * len(BYTE_ORDER_MARK) + text[len(BYTE_ORDER_MARK) :]

    keywords = _Keywords(text, bounds)
    return ObjLines(
        data=data,
        text=text,
        bounds=bounds,
        first_lines=first_lines,
        vertices=keywords.rows(b"v"),
        normals=keywords.rows(b"vn"),
        texcoords=keywords.rows(b"vt"),
        faces=keywords.rows(b"f"),
        objects=keywords.rows(b"o"),
        groups=keywords.rows(b"g"),
        materials=keywords.rows(b"usemtl"),
        libraries=keywords.rows(b"mtllib"),
    )


class _Keywords:
    """Finds statements by keyword."""

    def __init__(self, text: bytes, bounds: NDArray[np.int64]) -> None:
        self._characters = np.frombuffer(text + b"\n" * _PADDING, dtype=np.uint8)
        self._starts = bounds[:-1].copy()
        indented = np.flatnonzero(_BLANKS[self._characters[self._starts]])
        ends = bounds[indented + 1]
        for _ in range(_USUAL_INDENT):
            self._starts[indented] += 1
            still = _BLANKS[self._characters[self._starts[indented]]]
            still &= self._starts[indented] < ends
            indented, ends = indented[still], ends[still]
        for row, end in zip(indented.tolist(), ends.tolist(), strict=True):
            words = text[self._starts[row] : end].lstrip()
            self._starts[row] = end - len(words)
        # A statement of blanks alone must not be taken for the next one.
        self._starts[self._starts >= bounds[1:]] = len(text)
        self._first = self._characters[self._starts]

    def rows(self, keyword: bytes) -> NDArray[np.int64]:
        """(k,) statements whose first word is the keyword."""
        found = np.flatnonzero(self._first == keyword[0])
        for offset, character in enumerate(keyword[1:], 1):
            found = found[self._characters[self._starts[found] + offset] == character]
        ends = _BLANKS[self._characters[self._starts[found] + len(keyword)]]
        named: NDArray[np.int64] = found[ends]
        return named


def _line_bounds(data: bytes) -> NDArray[np.int64]:
    """Where each line starts, and the end of the last."""
    characters = np.frombuffer(data, dtype=np.uint8)
    is_end = characters == _RETURN
    is_end[:-1] &= characters[1:] != _NEWLINE
    is_end |= characters == _NEWLINE
    ends = np.flatnonzero(is_end) + 1
    unended = [len(data)] if len(data) and not is_end[-1] else []
    return np.concatenate([[0], ends, unended]).astype(np.int64, copy=False)


def _join_continued(
    data: bytes, bounds: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64], bytes]:
    """Bounds and first lines of statements that a backslash continues, and their text.

    A comment ends with its line.
    """
    text = np.frombuffer(data, dtype=np.uint8).copy()
    starts, last = bounds[:-1], bounds[1:] - 1
    is_pair = (text[last] == _NEWLINE) & (last > starts) & (text[last - 1] == _RETURN)
    before = last - 1 - is_pair
    continued = (before >= starts) & (text[before] == _BACKSLASH)
    continued &= (text[last] == _NEWLINE) | (text[last] == _RETURN)
    continued &= ~np.logical_or.reduceat(text == _HASH, starts)
    for place in (before, before + 1, last):
        text[place[continued]] = _BLANK
    first = np.flatnonzero(~np.concatenate([[False], continued[:-1]]))
    return np.append(starts[first], len(data)), first + 1, text.tobytes()
