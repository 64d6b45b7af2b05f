"""Reads the vertices and faces of a PLY file."""

from __future__ import annotations

import numpy as np

from meshcone.assets.foreign.ply_ascii import AsciiBody
from meshcone.assets.foreign.ply_binary import BinaryBody
from meshcone.assets.foreign.ply_header import Element, read_header
from meshcone.assets.foreign.polygons import Polygons, check_corners, check_positions
from meshcone.assets.limits import Limits
from meshcone.errors import InputError

_CORNER_NAMES = (b"vertex_indices", b"vertex_index")


def read_ply(data: bytes, limits: Limits) -> Polygons:
    """Read an ASCII or binary PLY file; what else it holds is passed over.

    Raises:
        InputError: with the line, byte or row at fault.
        LimitError: it is longer, or declares more, than ``limits`` accept.
    """
    header = read_header(data, limits)
    body: AsciiBody | BinaryBody
    if header.encoding == "ascii":
        body = AsciiBody(data[header.size :], header.lines + 1, limits)
    else:
        body = BinaryBody(data, header.size, limits)
    positions, vertex_place = np.zeros((0, 3)), body.place
    corners, sizes, face_place = np.zeros(0, np.int64), np.zeros(0, np.int64), body.place
    for element in header.elements:
        if element.name == b"vertex":
            positions = body.vertices(element, _coordinates(element))
            vertex_place = body.place
        elif element.name == b"face" and element.count:
            corners, sizes = body.polygons(element, _corners(element))
            face_place = body.place
        else:
            body.skip(element)
    check_positions(positions, vertex_place)
    check_corners(corners, sizes, len(positions), face_place)
    return Polygons(positions, corners, sizes)


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


def _corners(element: Element) -> int:
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
