"""Reads the vertices and faces of a PLY file."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.foreign.places import BinaryVectors, Places, TextVectors, Vectors
from meshcone.assets.foreign.ply_ascii import AsciiBody
from meshcone.assets.foreign.ply_binary import BinaryBody
from meshcone.assets.foreign.ply_header import Element, Header, read_header
from meshcone.assets.foreign.polygons import Polygons, check_corners, check_positions
from meshcone.assets.limits import Limits
from meshcone.errors import InputError

NORMAL = (b"nx", b"ny", b"nz")
_END = -1  # ends a strip within a list (Stanford's scans have all of a mesh in one)
_CORNER_NAMES = (b"vertex_indices", b"vertex_index")


def read_ply(data: bytes, limits: Limits) -> Polygons:
    """Read an ASCII or binary PLY file; what else it holds is passed over.

    Raises:
        InputError: with the line, byte or row at fault.
        LimitError: it is longer, or declares more, than ``limits`` accept.
    """
    header = read_header(data, limits)
    body = body_of(data, header, limits)
    positions, vertex_place = np.zeros((0, 3)), body.place
    none = np.zeros(0, np.int64)
    corners, sizes, face_place = none, none, body.place
    strips, strip_place = (none, none), body.place
    for element in header.elements:
        if element.name == b"vertex":
            positions = body.vertices(element, _coordinates(element))
            vertex_place = body.place
        elif element.name == b"face" and element.count:
            corners, sizes = body.polygons(element, corner_list(element))
            face_place = body.place
        elif element.name == b"tristrips" and element.count:
            strips, strip_place = body.polygons(element, corner_list(element)), body.place
        else:
            body.skip(element)
    check_positions(positions, vertex_place)
    check_corners(corners, sizes, len(positions), face_place)
    check_corners(*strips, len(positions), strip_place, least=_END)
    triangles = _triangles(*strips)
    return Polygons(
        positions,
        np.concatenate([corners, triangles.reshape(-1)]),
        np.concatenate([sizes, np.full(len(triangles), 3)]),
        _places(header),
    )


def body_of(data: bytes, header: Header, limits: Limits) -> AsciiBody | BinaryBody:
    """What reads the rows of a file, element by element."""
    if header.encoding == "ascii":
        return AsciiBody(data[header.size :], header.lines + 1, limits)
    return BinaryBody(data, header.size, limits)


def _places(header: Header) -> Places | None:
    """Where the vertices are; None without any, or where rows up to them differ in length."""
    above = next((n for n, e in enumerate(header.elements) if e.name == b"vertex"), None)
    if above is None or any(element.has_lists for element in header.elements[: above + 1]):
        return None
    vertex = header.elements[above]
    names = [item.name for item in vertex.properties]
    sizes = [item.values.itemsize for item in vertex.properties]
    skipped = [e for e in header.elements[:above] if e.properties]

    def vectors(wanted: tuple[bytes, bytes, bytes]) -> Vectors:
        x, y, z = (names.index(name) for name in wanted)
        first, second, third = (vertex.properties[place].values for place in (x, y, z))
        if header.encoding == "ascii":
            return TextVectors(
                start=header.size,
                skipped=sum(e.count for e in skipped),
                count=vertex.count,
                columns=(x, y, z),
                directions=wanted == NORMAL,
                kinds=(first, second, third),
            )
        return BinaryVectors(
            start=header.size + sum(e.count * e.least_bytes for e in skipped),
            stride=sum(sizes),
            count=vertex.count,
            offsets=(sum(sizes[:x]), sum(sizes[:y]), sum(sizes[:z])),
            kinds=(first, second, third),
        )

    has_normals = all(name in names for name in NORMAL)
    return Places(vectors((b"x", b"y", b"z")), vectors(NORMAL) if has_normals else None)


def _triangles(corners: NDArray[np.int64], lengths: NDArray[np.int64]) -> NDArray[np.int64]:
    """(k, 3) triangles of strips that follow each other, in rows and between ends within them.

    A strip repeats a corner to turn; what that makes is no triangle.
    """
    if len(corners) == 0:
        return np.zeros((0, 3), dtype=np.int64)
    starts = np.zeros(len(corners) + 1, dtype=bool)
    starts[np.concatenate([[0], np.cumsum(lengths)])] = True
    starts[1:] |= corners == _END
    places = np.arange(len(corners))
    step = places - np.maximum.accumulate(np.where(starts[:-1], places, 0))
    last = np.flatnonzero((step >= 2) & (corners != _END))
    a, b, c = corners[last - 2], corners[last - 1], corners[last]
    turned = step[last] % 2 == 1
    triangles = np.stack([np.where(turned, b, a), np.where(turned, a, b), c], axis=1)
    whole: NDArray[np.int64] = triangles[(a != b) & (b != c) & (c != a)]
    return whole


def _coordinates(element: Element) -> tuple[int, int, int]:
    """Where x, y and z are among an element's properties."""
    numbers = {p.name: place for place, p in enumerate(element.properties) if p.length is None}
    missing = [name for name in (b"x", b"y", b"z") if name not in numbers]
    if missing:
        raise InputError(
            f"expected a number '{missing[0].decode()}' among its properties, found none",
            place=element.place,
        )
    return numbers[b"x"], numbers[b"y"], numbers[b"z"]


def corner_list(element: Element) -> int:
    """Where the list of corners is among an element's properties."""
    lists = {p.name: place for place, p in enumerate(element.properties) if p.length is not None}
    named = [lists[name] for name in _CORNER_NAMES if name in lists]
    chosen = named or (list(lists.values()) if len(lists) == 1 else [])
    if not chosen:
        raise InputError(
            "expected a list 'vertex_indices' among its properties, found none",
            place=element.place,
        )
    if element.properties[chosen[0]].values.kind == "f":
        raise InputError("expected a list of whole numbers for its corners", place=element.place)
    return chosen[0]
