"""Reads the data of a PLY file that are bytes, each extent compared with what is left first."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.foreign.ply_header import Element
from meshcone.assets.limits import Limits
from meshcone.errors import InputError

Row = dict[int, NDArray[Any]]


class BinaryBody:
    """The bytes after a header, read element by element.

    Attributes:
        place: where a row of the element read last stands.
    """

    def __init__(self, data: bytes, start: int, limits: Limits) -> None:
        self._data = data
        self._position = start
        self._limits = limits
        self.place: Callable[[int], str] = str

    def vertices(self, element: Element, coordinates: tuple[int, int, int]) -> NDArray[np.float64]:
        """(r, 3) coordinates; see :meth:`numbers`."""
        return self.numbers(element, coordinates)

    def numbers(self, element: Element, places: Sequence[int]) -> NDArray[np.float64]:
        """(r, k) numbers of some of an element's properties that are no lists.

        Raises:
            InputError: the element reaches past the file.
            LimitError: there is too much to read row by row.
        """
        found = np.empty((element.count, len(places)))
        table = self._table(element)
        if table is not None:
            with np.errstate(invalid="ignore"):  # a signalling NaN; of places it is refused later
                for column, place in enumerate(places):
                    found[:, column] = table[f"f{place}"]
            return found
        for number, row in enumerate(self._rows(element, places)):
            found[number] = [row[place][0] for place in places]
        return found

    def lists(self, element: Element, place: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """(c,) values of all rows of a list, and (r,) how many each has.

        Raises:
            InputError: the element reaches past the file.
            LimitError: there is too much to read row by row.
        """
        table = self._table(element)
        if table is not None:
            values = table[f"f{place}"].astype(np.float64)
            return values.reshape(-1), np.full(element.count, values.size // max(element.count, 1))
        rows = [row[place].astype(np.float64) for row in self._rows(element, (place,))]
        sizes = np.array([len(row) for row in rows], dtype=np.int64)
        return np.concatenate([np.zeros(0), *rows]), sizes

    def polygons(
        self, element: Element, corners: int
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """(c,) corners of all rows, and (p,) how many each has.

        Raises:
            InputError: the element reaches past the file.
            LimitError: they make too many triangles, or there is too much to read row by row.
        """
        table = self._table(element)
        if table is not None:
            values = table[f"f{corners}"].astype(np.int64)
            size = values.size // max(element.count, 1)
            self._check_triangles(values.size - 2 * element.count, element.count - 1)
            return values.reshape(-1), np.full(element.count, size)
        found: list[int] = []
        sizes = np.empty(element.count, dtype=np.int64)
        for number, row in enumerate(self._rows(element, (corners,))):
            sizes[number] = len(row[corners])
            triangles = len(found) + len(row[corners]) - 2 * (number + 1)
            self._check_triangles(triangles, number)
            found += row[corners].tolist()
        return np.array(found, dtype=np.int64), sizes

    def skip(self, element: Element) -> None:
        """Pass over an element.

        Raises:
            InputError: it reaches past the file.
            LimitError: there is too much to read row by row.
        """
        if element.properties and self._table(element) is None:
            for _ in self._rows(element, ()):
                pass

    def extents(self, element: Element) -> NDArray[np.int64]:
        """(n + 1,) the byte at which each row begins, and where the last one ends.

        Raises:
            InputError: the element reaches past the file.
            LimitError: there is too much to read row by row.
        """
        start = self._position
        if self._table(element) is not None:
            stride = (self._position - start) // max(element.count, 1)
            return start + stride * np.arange(element.count + 1, dtype=np.int64)
        ends = [start, *(self._position for _ in self._rows(element, ()))]
        return np.array(ends, dtype=np.int64)

    def _check_triangles(self, count: int, row: int) -> None:
        self._limits.check("faces", count, "triangles", self.place(row))

    def _table(self, element: Element) -> NDArray[Any] | None:
        """All rows at once, if none has a list or all have lists as long as the first row's."""
        start, name = self._position, element.place
        self._require(element.count * element.least_bytes, name)
        lengths = [0] * len(element.properties)
        if element.has_lists and element.count:
            self.place = lambda row: f"{element.place}, row {row}"
            first = self._row(element, 0, range(len(element.properties)))
            self._position = start
            lengths = [len(values) for values in first.values()]
        fields: list[Any] = []
        for place, (item, length) in enumerate(zip(element.properties, lengths, strict=True)):
            if item.length is not None:
                fields.append((f"n{place}", item.length))
            shape = () if item.length is None else (length,)
            fields.append((f"f{place}", item.values, shape))
        dtype = np.dtype(fields)
        end = start + element.count * dtype.itemsize
        if end > len(self._data):
            return None
        table = np.frombuffer(self._data, dtype, element.count, start)
        for place, length in enumerate(lengths):
            counted = element.properties[place].length is not None
            if counted and (table[f"n{place}"] != length).any():
                return None
        self._position = end
        self.place = lambda row: f"byte {start + row * dtype.itemsize}"
        return table

    def _rows(self, element: Element, wanted: Collection[int]) -> Iterator[Row]:
        """Rows one after the other; what is to be read of them counts against the cap on lines."""
        cells = element.count * len(element.properties)
        what = "numbers and lists in rows of different lengths"
        self._limits.check("lines", cells, what, element.place)
        self.place = lambda row: f"{element.place}, row {row}"
        for row in range(element.count):
            yield self._row(element, row, wanted)

    def _row(self, element: Element, row: int, wanted: Collection[int]) -> Row:
        """The values of some of a row's properties, by the place of each among all."""
        values: Row = {}
        for place, item in enumerate(element.properties):
            size = 1 if item.length is None else self._length(item.length, row)
            start = self._pass(size * item.values.itemsize, row)
            if place in wanted:
                values[place] = np.frombuffer(self._data, item.values, size, start)
        return values

    def _length(self, kind: np.dtype[Any], row: int) -> int:
        start = self._pass(kind.itemsize, row)
        stored = self._data[start : self._position]
        order: Literal["big", "little"] = "big" if kind.str[0] == ">" else "little"
        size = int.from_bytes(stored, order, signed=kind.kind == "i")
        if size < 0:
            raise InputError(f"a list of length {size}", place=self.place(row))
        return size

    def _pass(self, size: int, row: int) -> int:
        """Go on by some bytes; where they start."""
        start = self._position
        if size > len(self._data) - start:
            self._require(size, self.place(row))
        self._position = start + size
        return start

    def _require(self, needed: int, place: str) -> None:
        left = len(self._data) - self._position
        if needed > left:
            raise InputError(
                f"expected {needed:,} bytes, found {left:,} up to the end of the file",
                place=f"{place}, byte {self._position}",
            )
