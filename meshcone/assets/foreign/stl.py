"""Reads stereolithography files.

Source: "StereoLithography Interface Specification", 3D Systems (1988). A binary file is 80
bytes of anything, a count, and 50 bytes for each triangle; some start with ``solid`` too, so
the length decides.
"""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.foreign.places import BinaryVectors, Places, TextVectors, Vectors, statements
from meshcone.assets.foreign.polygons import Polygons, check_positions
from meshcone.assets.foreign.text import Line, content_lines, points, shown
from meshcone.assets.limits import Limits
from meshcone.errors import InputError

HEADER = 84
_BLANK = rb"(?:\s|#[^\r\n]*+[\r\n])*+"
_SOLID = re.compile(_BLANK + rb"solid\b", re.I)
_TEXT = re.compile(_BLANK + rb"solid\b[^\r\n]*+[\r\n]" + _BLANK + rb"facet\b", re.I)
_SEARCHED = 65_536
_FACETS = re.compile(rb"^[ \t]*facet\s[^\x00]{0,400}?\bvertex\s", re.I | re.M)
_STATEMENT = re.compile(rb"\b(?:solid|facet|outer|vertex|endloop|endfacet|endsolid)\b", re.I)
_PRINTABLE = re.compile(rb"[\t\n\r -~]+")
TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])

# What may come after each line of an ASCII file, and where that leads.
_NEXT = {
    "the beginning": {b"solid": "solid", b"facet": "facet"},
    "solid": {b"facet": "facet", b"endsolid": "endsolid"},
    "facet": {b"outer": "outer loop"},
    "outer loop": {b"vertex": "the first vertex"},
    "the first vertex": {b"vertex": "the second vertex"},
    "the second vertex": {b"vertex": "the third vertex"},
    "the third vertex": {b"endloop": "endloop"},
    "endloop": {b"endfacet": "endfacet"},
    "endfacet": {b"facet": "facet", b"endsolid": "endsolid"},
    "endsolid": {b"solid": "solid"},
}


def is_binary_stl(data: bytes) -> bool:
    """Whether a file is exactly as long as its count of triangles says."""
    return len(data) >= HEADER and len(data) == _binary_length(data)


def is_text_stl(data: bytes) -> bool:
    """Whether a file begins as an ASCII STL does; some exporters put comments first."""
    return _TEXT.match(data) is not None


def read_stl(data: bytes, limits: Limits) -> Polygons:
    """Read an ASCII or binary STL file; its normals are passed over.

    Raises:
        InputError: with the line or byte at fault.
        LimitError: more triangles than ``limits`` accept.
    """
    if is_binary_stl(data):
        return _read_binary(data, limits)
    if _SOLID.match(data) or _is_text_of_facets(data):
        return _read_ascii(data, limits)
    if len(data) < HEADER:
        raise InputError(f"a binary STL has at least {HEADER} bytes, the file {len(data)}")
    if _PRINTABLE.fullmatch(data, 0, HEADER):
        raise InputError(
            "expected 'solid' or 'facet' at the beginning of a text, or a binary STL, found "
            f"'{shown(data.split(None, 1)[0])}'",
            place="line 1",
        )
    raise InputError(
        f"expected {_binary_length(data):,} bytes for the triangles declared, found {len(data):,}",
        place="byte 80",
    )


def _is_text_of_facets(data: bytes) -> bool:
    """Whether a text begins with its facets, or with lines that some programs write above them."""
    return b"\x00" not in data[:_SEARCHED] and _FACETS.search(data, 0, _SEARCHED) is not None


def _is_remark(line: bytes) -> bool:
    """Whether a line says something in another way than with a number sign."""
    return line.startswith((b";", b"//")) and _STATEMENT.search(line) is None


def _binary_length(data: bytes) -> int:
    (count,) = struct.unpack_from("<I", data, 80)
    return HEADER + TRIANGLE.itemsize * int(count)


def _read_binary(data: bytes, limits: Limits) -> Polygons:
    count = (len(data) - HEADER) // TRIANGLE.itemsize
    limits.check("faces", count, "triangles", "byte 80")
    limits.check("vertices", 3 * count, "vertices", "byte 80")
    table = np.frombuffer(data, TRIANGLE, offset=HEADER)
    with np.errstate(invalid="ignore"):  # a signalling NaN
        positions = table["corners"].reshape(-1, 3).astype(np.float64)
    check_positions(positions, lambda row: f"byte {HEADER + row // 3 * 50 + 12 + row % 3 * 12}")
    return _soup(positions, Places(_Corners(count), _facet(count, 0), by_facet=True))


def _read_ascii(data: bytes, limits: Limits) -> Polygons:
    vertices: list[Line] = []
    state, number, named = "the beginning", 1, False
    for number, text in content_lines(data, limits, comments=True):
        if state == "the beginning" and _is_remark(text):
            continue
        for start, end in statements(text):
            statement = text[start:end].strip()
            keyword = statement.split(None, 1)[0].lower()
            if keyword not in _NEXT[state]:
                raise _unexpected(state, f"'{shown(keyword)}'", number)
            state = _NEXT[state][keyword]
            named |= keyword == b"solid"
            if keyword == b"vertex":
                vertices.append((number, statement[len(keyword) :]))
    # Facets that no solid is above have no end to it either.
    if state != "endsolid" and (named or state != "endfacet"):
        raise _unexpected(state, "the end of the file", number)
    limits.check("faces", len(vertices) // 3, "triangles")
    limits.check("vertices", len(vertices), "vertices")
    words = TextVectors(0, 0, len(vertices), (1, 2, 3), comments=True, keyword=b"vertex")
    facets = TextVectors(
        0,
        0,
        len(vertices) // 3,
        (2, 3, 4),
        comments=True,
        keyword=b"facet",
        directions=True,
    )
    return _soup(points(vertices), Places(words, facets, by_facet=True))


def _unexpected(state: str, found: str, line: int) -> InputError:
    expected = " or ".join(f"'{keyword.decode()}'" for keyword in _NEXT[state])
    return InputError(f"expected {expected} after {state}, found {found}", place=f"line {line}")


def _facet(count: int, offset: int) -> BinaryVectors:
    """Three numbers of each facet of a binary file."""
    real = np.dtype("<f4")
    offsets = (offset, offset + 4, offset + 8)
    return BinaryVectors(HEADER, TRIANGLE.itemsize, count, offsets, (real, real, real))


@dataclass(frozen=True)
class _Corners(Vectors):
    """The three corners of each facet of a binary file, one after the other."""

    facets: int

    def read(self, data: bytes) -> NDArray[np.float64]:
        corners = [_facet(self.facets, 12 * (1 + corner)).read(data) for corner in range(3)]
        return np.stack(corners, axis=1).reshape(-1, 3)

    def write(self, data: bytearray, rows: NDArray[np.int64], values: NDArray[np.float64]) -> None:
        for corner in range(3):
            own = rows % 3 == corner
            _facet(self.facets, 12 * (1 + corner)).write(data, rows[own] // 3, values[own])

    def steps(self, data: bytes, values: NDArray[np.float64]) -> NDArray[np.float64]:
        return _facet(self.facets, 12).steps(data, values)


def _soup(positions: NDArray[np.float64], places: Places) -> Polygons:
    """Triangles that share no vertex; welding joins them."""
    corners = np.arange(len(positions), dtype=np.int64)
    sizes = np.full(len(positions) // 3, 3, dtype=np.int64)
    return Polygons(positions, corners, sizes, places)
