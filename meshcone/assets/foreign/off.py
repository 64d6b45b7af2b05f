"""Reads the Object File Format.

Source: Geomview manual, "OFF Files": a header keyword whose letters say what vertices carry
besides a position, three counts, and a line for each vertex and each face.
"""

from __future__ import annotations

import re

import numpy as np

from meshcone.assets.foreign.polygons import Polygons, check_corners
from meshcone.assets.foreign.text import Line, content_lines, integer, points, shown, take
from meshcone.assets.limits import Limits
from meshcone.errors import InputError

_KEYWORD = re.compile(rb"(?:ST)?C?N?(4?n?)OFF(?![A-Za-z_])\s*+")


def read_off(data: bytes, limits: Limits) -> Polygons:
    """Read an ASCII OFF file; colours, normals and texture coordinates are passed over.

    Raises:
        InputError: with the line at fault.
        LimitError: it declares more than ``limits`` accept.
    """
    lines = content_lines(data, limits, comment=b"#")
    number, text = next(lines, (1, b""))
    keyword = _KEYWORD.match(text)
    if keyword is None:
        raise InputError(f"expected 'OFF', found '{shown(text)}'", place=f"line {number}")
    counts = text[keyword.end() :]
    if keyword[1] or counts.startswith(b"BINARY"):
        raise InputError(
            f"'{shown(text)}' is not supported; expected a three-dimensional ASCII OFF",
            place=f"line {number}",
        )
    if not counts:
        ((number, counts),) = take(lines, 1, "line of counts")
    vertices, faces = _counts(counts, number, limits)
    positions = points(take(lines, vertices, "vertices"))
    stated = take(lines, faces, "faces")
    corners: list[int] = []
    sizes = np.empty(faces, dtype=np.int64)
    for row, line in enumerate(stated):
        found = _corners(line, limits, len(corners) - 2 * row)
        sizes[row] = len(found)
        corners += found
    polygons = Polygons(positions, np.array(corners, dtype=np.int64), sizes)
    check_corners(polygons.corners, sizes, vertices, lambda row: f"line {stated[row][0]}")
    return polygons


def _counts(text: bytes, line: int, limits: Limits) -> tuple[int, int]:
    words = text.split(None, 3)[:2]
    if len(words) < 2:
        raise InputError(
            f"expected the numbers of vertices and faces, found '{shown(text)}'",
            place=f"line {line}",
        )
    vertices, faces = (integer(word, line, "a count") for word in words)
    if min(vertices, faces) < 0:
        raise InputError(f"expected a count, found {min(vertices, faces)}", place=f"line {line}")
    limits.check("vertices", vertices, "vertices", f"line {line}")
    limits.check("faces", faces, "faces", f"line {line}")
    return vertices, faces


def _corners(line: Line, limits: Limits, triangles: int) -> list[int]:
    number, text = line
    size = integer(text.split(None, 1)[0], number, "a number of corners")
    if size < 0:
        raise InputError(f"expected a number of corners, found {size}", place=f"line {number}")
    # Counted before the line is cut into words: it may hold any number of them.
    limits.check("faces", triangles + size - 2, "triangles", f"line {number}")
    words = text.split(None, size + 1)[1 : size + 1]
    if len(words) < size:
        raise InputError(f"expected {size} corners, found {len(words)}", place=f"line {number}")
    return [integer(word, number, "the index of a vertex") for word in words]
