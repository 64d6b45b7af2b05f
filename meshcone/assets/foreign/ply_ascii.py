"""Reads the data of a PLY file that are text: a line for each row."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.foreign.ply_header import Element
from meshcone.assets.foreign.text import (
    Line,
    columns_of,
    content_lines,
    decimal,
    integer,
    number_or_nan,
    points,
    require,
    shown,
    take,
)
from meshcone.assets.limits import Limits
from meshcone.errors import InputError, MeshConeError

_WORD = re.compile(rb"\S+")


class AsciiBody:
    """The lines after a header, read element by element.

    Attributes:
        place: where a row of the element read last stands.
    """

    def __init__(self, data: bytes, first_line: int, limits: Limits) -> None:
        self._lines = content_lines(data, limits, first_line)
        self._limits = limits
        self.place: Callable[[int], str] = str

    def vertices(self, element: Element, coordinates: tuple[int, int, int]) -> NDArray[np.float64]:
        """(r, 3) coordinates.

        Raises:
            InputError: a line is missing, too short or holds no number.
        """
        lines = self._take(element)
        if not element.has_lists:
            return points(lines, coordinates)
        positions = np.empty((len(lines), 3))
        for row, line in enumerate(lines):
            found = dict(_values(element, line, coordinates, self._limits))
            positions[row] = [decimal(found[column][0], line[0]) for column in coordinates]
        return positions

    def numbers(self, element: Element, places: Sequence[int]) -> NDArray[np.float64]:
        """(r, k) numbers of some of an element's properties that are no lists.

        Where a row has none it is NaN: what follows the places need not be there.
        """
        lines = self._take(element)
        if not element.has_lists:
            return columns_of(lines, places)
        found = np.full((len(lines), len(places)), np.nan)
        for row, line in enumerate(lines):
            words = self._found(element, line, tuple(places))
            found[row] = [number_or_nan(*words.get(place, ())) for place in places]
        return found

    def lists(self, element: Element, place: int) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """(c,) values of all rows of a list, and (r,) how many each has; 0 where it is missing."""
        rows = [
            list(map(number_or_nan, self._found(element, line, (place,)).get(place, [])))
            for line in self._take(element)
        ]
        sizes = np.array(list(map(len, rows)), dtype=np.int64)
        return np.array([value for row in rows for value in row], dtype=np.float64), sizes

    def polygons(
        self, element: Element, corners: int
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """(c,) corners of all rows, and (p,) how many each has.

        Raises:
            InputError: a line is missing, too short or holds no number.
            LimitError: they make too many triangles.
        """
        lines = self._take(element)
        found: list[int] = []
        sizes = np.empty(len(lines), dtype=np.int64)
        for row, line in enumerate(lines):
            words = dict(_values(element, line, (corners,), self._limits))[corners]
            sizes[row] = len(words)
            found += [integer(word, line[0], "the index of a vertex") for word in words]
            triangles = len(found) - 2 * (row + 1)
            self._limits.check("faces", triangles, "triangles", f"line {line[0]}")
        return np.array(found, dtype=np.int64), sizes

    def require_whole(self, element: Element) -> None:
        """Check that every row has all that the header declares.

        What follows the places and corners is not needed to read a surface, and may be missing.

        Raises:
            InputError: a row has less.
        """
        last = len(element.properties) - 1
        for line in self._take(element) if element.properties else ():
            for _ in _values(element, line, (last,), self._limits):
                pass

    def skip(self, element: Element) -> None:
        """Pass over an element.

        Raises:
            InputError: a line is missing.
        """
        if element.properties:
            passed = [number for number, _ in islice(self._lines, element.count)]
            require(element.count, _rows_of(element), passed)

    def _found(
        self, element: Element, line: Line, places: tuple[int, ...]
    ) -> dict[int, list[bytes]]:
        """Words of some properties, as far as a row has them."""
        found: dict[int, list[bytes]] = {}
        try:
            for place, words in _values(element, line, places, self._limits):
                found[place] = words
        except MeshConeError:
            pass  # what surfaces need of the row was read
        return found

    def _take(self, element: Element) -> list[Line]:
        lines = take(self._lines, element.count, _rows_of(element))
        self.place = lambda row: f"line {lines[row][0]}"
        return lines


def _rows_of(element: Element) -> str:
    return f"rows of element '{shown(element.name)}'"


def _values(
    element: Element, line: Line, wanted: tuple[int, ...], limits: Limits
) -> Iterator[tuple[int, list[bytes]]]:
    """Words of some of a row's properties, taken one after the other from a line of any length."""
    number, text = line
    words = (match.group() for match in _WORD.finditer(text))
    for place, item in enumerate(element.properties[: max(wanted) + 1]):
        size = 1
        if item.length is not None:
            size = integer(next(words, b""), number, "the length of a list")
            if size < 0:
                raise InputError(f"a list of length {size}", place=f"line {number}")
            limits.check("faces", size - 2, "values in a list", f"line {number}")
        found = [word for _, word in zip(range(size), words, strict=False)]
        if len(found) < size:
            raise InputError(
                f"expected {size} values of '{shown(item.name)}', found {len(found)}",
                place=f"line {number}",
            )
        if place in wanted:
            yield place, found
