"""Where a PLY, STL or OFF file has the numbers of its vertices and normals, and new ones there."""

from __future__ import annotations

import abc
import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.comments import uncommented
from meshcone.assets.foreign.whole import Whole, misfit, rounded, whole_columns
from meshcone.assets.number_style import NumberStyle, steps_of_floats

_LINE = re.compile(rb"[^\r\n]+")
_WORD = re.compile(rb"\S+")
_SAMPLED = 20_000
_FIRST = 2_000  # rows whose digits tell how precise a file is
# Words of each statement of an ASCII STL: a line that has no more has one statement.
_WORDS = {b"facet": 5, b"outer": 2, b"vertex": 4, b"endloop": 1, b"endfacet": 1}
_MOST_WORDS = 5
_FACET = re.compile(rb"\s(facet\s+normal\s+[-+.\d])", re.I)
_KEYWORD = re.compile(rb"\s((?:facet|outer|vertex|endloop|endfacet|endsolid)(?!\S))", re.I)

Columns = tuple[int, int, int]
Kinds = tuple[np.dtype[Any], np.dtype[Any], np.dtype[Any]]
Spans = list[tuple[int, int]]


class Vectors(abc.ABC):
    """A row of three numbers for each vertex, or for each facet, somewhere in a file."""

    @abc.abstractmethod
    def read(self, data: bytes) -> NDArray[np.float64]:
        """(n, 3) numbers; NaN in all of a row that has others."""

    @abc.abstractmethod
    def write(self, data: bytearray, rows: NDArray[np.int64], values: NDArray[np.float64]) -> None:
        """Put (k, 3) numbers in the place of those of some rows.

        Raises:
            InputError: one does not fit the type the file has.
        """

    @abc.abstractmethod
    def steps(self, data: bytes, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """(n,) how far apart the numbers are that the file can hold where they are (n, 3) others.

        It is 0 where they are those of a float64, or whole.
        """

    def whole(self, stored: NDArray[np.float64]) -> Whole:  # noqa: ARG002
        """The types of the three numbers where they hold whole ones alone.

        Args:
            stored: what :meth:`read` gives.
        """
        return (None, None, None)


@dataclass(frozen=True)
class BinaryVectors(Vectors):
    """Three numbers of each row of a table of bytes.

    Attributes:
        start: byte the first row begins at.
        stride: bytes from a row to the next.
        count: how many rows.
        offsets: bytes from the beginning of a row to each number.
        kinds: their types.
    """

    start: int
    stride: int
    count: int
    offsets: Columns
    kinds: Kinds

    def read(self, data: bytes) -> NDArray[np.float64]:
        """See :meth:`Vectors.read`."""
        with np.errstate(invalid="ignore"):
            columns = [column.astype(np.float64) for column in self._columns(data)]
        return np.stack(columns, axis=1)

    def write(self, data: bytearray, rows: NDArray[np.int64], values: NDArray[np.float64]) -> None:
        """See :meth:`Vectors.write`."""
        for axis, column in enumerate(self._columns(data)):
            wanted = values[:, axis]
            if column.dtype.kind != "f":
                wanted, fits = rounded(wanted, column.dtype)
            else:
                with np.errstate(over="ignore"):
                    fits = np.isfinite(wanted.astype(column.dtype))
            if not fits.all():
                place = self.start + self.stride * int(rows[np.argmin(fits)])
                raise misfit(column.dtype, f"byte {place}")
            column[rows] = wanted.astype(column.dtype)

    def steps(self, data: bytes, values: NDArray[np.float64]) -> NDArray[np.float64]:  # noqa: ARG002
        """See :meth:`Vectors.steps`."""
        found = [steps_of_floats(values, kind) for kind in self.kinds]
        return np.asarray(np.max(found, axis=0))

    def whole(self, stored: NDArray[np.float64]) -> Whole:
        """See :meth:`Vectors.whole`."""
        return whole_columns(self.kinds, stored)

    def _columns(self, data: bytes | bytearray) -> list[NDArray[Any]]:
        return [
            np.ndarray((self.count,), kind, data, self.start + offset, (self.stride,))
            for offset, kind in zip(self.offsets, self.kinds, strict=True)
        ]


@dataclass(frozen=True)
class TextVectors(Vectors):
    """Three words of each of a run of lines.

    Attributes:
        start: byte the first of all lines begins at.
        skipped: lines with content before the first row.
        count: how many rows.
        columns: which words of a row.
        words: how many a row has at least; it may be wrapped where it has fewer.
        comments: whether ``#`` starts one.
        keyword: the first word of the statements that are rows; None where every line is one.
        directions: whether the numbers are of unit vectors.
        kinds: the types that the file declares; None where it declares none.
    """

    start: int
    skipped: int
    count: int
    columns: Columns
    words: int = 1
    comments: bool = False
    keyword: bytes | None = None
    directions: bool = False
    kinds: Kinds | None = None

    def read(self, data: bytes) -> NDArray[np.float64]:
        """See :meth:`Vectors.read`."""
        rows = np.full((self.count, 3), np.nan)
        for row, spans in enumerate(self._rows(data)):
            try:
                rows[row] = [float(data[start:end]) for start, end in spans]
            except ValueError:
                continue
        rows[~np.isfinite(rows).all(axis=1)] = np.nan
        return rows

    def write(self, data: bytearray, rows: NDArray[np.int64], values: NDArray[np.float64]) -> None:
        """See :meth:`Vectors.write`; numbers that stay keep their text."""
        text = bytes(data)
        old = self.read(text)
        number = self._style(text, old, values).format
        values = values + 0.0
        columns = self.whole(old)
        for axis, kind in enumerate(columns):
            if kind is not None:
                values[:, axis] = self._fitting(values[:, axis], kind, rows, text)
        formats = [number if kind is None else b"%d" for kind in columns]
        wanted = dict(zip(rows.tolist(), values.tolist(), strict=True))
        pieces, reached = [], 0
        for row, spans in enumerate(self._rows(text)):
            if row not in wanted:
                continue
            # A header may name the numbers of a vertex in any order, as z, y and x.
            for (start, end), value, before, form in sorted(
                zip(spans, wanted[row], old[row].tolist(), formats, strict=False)
            ):
                if value != before:
                    pieces += [text[reached:start], form % value]
                    reached = end
        data[:] = b"".join([*pieces, text[reached:]])

    def steps(self, data: bytes, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """See :meth:`Vectors.steps`: by the digits of the first rows."""
        rows = islice(self._rows(data), _FIRST)
        return NumberStyle.of(data[a:b] for spans in rows for a, b in spans).steps(values)

    def whole(self, stored: NDArray[np.float64]) -> Whole:
        """See :meth:`Vectors.whole`."""
        if self.kinds is None:
            return super().whole(stored)
        return whole_columns(self.kinds, stored)

    def _fitting(
        self, values: NDArray[np.float64], kind: np.dtype[Any], rows: NDArray[np.int64], text: bytes
    ) -> NDArray[np.float64]:
        nearest, fits = rounded(values, kind)
        if not fits.all():
            row = int(rows[np.argmin(fits)])
            spans = next(islice(self._rows(text), row, None), [])
            start = spans[0][0] if spans else len(text)
            raise misfit(kind, f"line {len(text[: start + 1].splitlines())}")
        return nearest

    def _style(
        self, text: bytes, old: NDArray[np.float64], new: NDArray[np.float64]
    ) -> NumberStyle:
        step = max(1, self.count // _SAMPLED)
        style = NumberStyle.of(
            text[start:end]
            for spans in islice(self._rows(text), 0, None, step)
            for start, end in spans
        )
        if self.directions:
            return style.for_normals()
        return style.resolving(np.concatenate([old[np.isfinite(old).all(axis=1)], new]))

    def _rows(self, data: bytes) -> Iterator[Spans]:
        """Where the three words of each row are; none, where a line lacks one of them."""
        lines = islice(self._lines(data), self.skipped, None)
        for _, words in zip(range(self.count), lines, strict=False):
            while len(words) < self.words and (more := next(lines, None)):
                words = words + more
            whole = max(self.columns) < len(words)
            yield [words[column] for column in self.columns] if whole else []

    def _lines(self, data: bytes) -> Iterator[Spans]:
        for match in _LINE.finditer(data, self.start):
            text, start = uncommented(match[0]) if self.comments else match[0], match.start()
            for span in self._stated(text):
                words = [(start + w.start(), start + w.end()) for w in _WORD.finditer(text, *span)]
                if words:
                    yield words

    def _stated(self, line: bytes) -> Spans:
        """Where the statements of a line are that are rows."""
        if self.keyword is None:
            return [(0, len(line))]
        first = len(self.keyword)
        return [
            (start, end)
            for start, end in statements(line)
            if (words := line[start:end].split(None, 1))
            and len(words[0]) == first
            and words[0].lower() == self.keyword
        ]


@dataclass(frozen=True)
class Places:
    """Where a file has what writing may change.

    Attributes:
        positions: of each vertex.
        normals: of each vertex, or of each facet; None if it has none.
        by_facet: which of the two.
    """

    positions: Vectors
    normals: Vectors | None = None
    by_facet: bool = False


def statements(line: bytes) -> Spans:
    """Where the statements of an ASCII STL are in a line, which mostly has one.

    A solid may be called anything, so that of words after it only a facet with its normal counts.
    """
    words = line.split(None, _MOST_WORDS)
    keyword = words[0].lower() if words else b""
    if len(words) <= _WORDS.get(keyword, 0) or keyword == b"endsolid":
        return [(0, len(line))]
    reached, starts = 0, [0]
    if keyword == b"solid":
        facet = _FACET.search(line)
        if facet is None:
            return [(0, len(line))]
        reached = facet.start(1)
        starts.append(reached)
    starts += [match.start(1) for match in _KEYWORD.finditer(line, reached)]
    return list(zip(starts, [*starts[1:], len(line)], strict=True))
