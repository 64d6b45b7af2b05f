"""Reads the data of a PLY file that are bytes, each extent compared with what is left first."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.foreign.ply_header import Element
from meshcone.assets.limits import Limits
from meshcone.errors import InputError

Row = list[tuple[Any, ...]]


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
        """(r, 3) coordinates.

        Raises:
            InputError: the element reaches past the file.
        """
        table = self._table(element)
        if table is not None:
            with np.errstate(invalid="ignore"):  # a signalling NaN; it is refused below
                columns = [table[f"f{place}"].astype(np.float64) for place in coordinates]
            return np.stack(columns, axis=1)
        positions = np.empty((element.count, 3))
        for number, row in enumerate(self._rows(element)):
            positions[number] = [row[place][0] for place in coordinates]
        return positions

    def polygons(
        self, element: Element, corners: int
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """(c,) corners of all rows, and (p,) how many each has.

        Raises:
            InputError: the element reaches past the file.
            LimitError: they make too many triangles.
        """
        table = self._table(element)
        if table is not None:
            values = table[f"f{corners}"].astype(np.int64)
            size = values.size // max(element.count, 1)
            self._check_triangles(values.size - 2 * element.count, element.count - 1)
            return values.reshape(-1), np.full(element.count, size)
        found: list[int] = []
        sizes = np.empty(element.count, dtype=np.int64)
        for number, row in enumerate(self._rows(element)):
            found += row[corners]
            sizes[number] = len(row[corners])
            self._check_triangles(len(found) - 2 * (number + 1), number)
        return np.array(found, dtype=np.int64), sizes

    def skip(self, element: Element) -> None:
        """Pass over an element.

        Raises:
            InputError: it reaches past the file.
        """
        if element.properties and self._table(element) is None:
            for _ in self._rows(element):
                pass

    def _check_triangles(self, count: int, row: int) -> None:
        self._limits.check("faces", count, "triangles", self.place(row))

    def _table(self, element: Element) -> NDArray[Any] | None:
        """All rows at once, if none has a list or all have lists as long as the first row's."""
        start, name = self._position, element.place
        self._require(element.count * element.least_bytes, name)
        lengths = [0] * len(element.properties)
        if element.has_lists and element.count:
            first = next(self._rows(element))
            self._position = start
            lengths = [len(values) for values in first]
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

    def _rows(self, element: Element) -> Iterator[Row]:
        """Rows one after the other, each a tuple of values for each property."""
        self.place = lambda row: f"{element.place}, row {row}"
        for row in range(element.count):
            values: Row = []
            for item in element.properties:
                size = 1
                if item.length is not None:
                    (size,) = self._unpack(item.length, 1, row)
                    if size < 0:
                        raise InputError(f"a list of length {size}", place=self.place(row))
                values.append(self._unpack(item.values, size, row))
            yield values

    def _unpack(self, kind: np.dtype[Any], count: int, row: int) -> tuple[Any, ...]:
        self._require(count * kind.itemsize, self.place(row))
        layout = struct.Struct(f"{'>' if kind.str[0] == '>' else '<'}{count}{kind.char}")
        found = layout.unpack_from(self._data, self._position)
        self._position += layout.size
        return found

    def _require(self, needed: int, place: str) -> None:
        left = len(self._data) - self._position
        if needed > left:
            raise InputError(
                f"expected {needed:,} bytes, found {left:,} up to the end of the file",
                place=f"{place}, byte {self._position}",
            )
