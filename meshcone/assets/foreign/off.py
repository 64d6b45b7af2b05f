"""Reads the Object File Format.

Source: Geomview manual, "OFF Files": a header keyword whose letters say what vertices carry
besides a position, three counts, and a line for each vertex and each face. Long lines are
found wrapped, which the manual does not say and its own reader accepts.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import chain, islice

import numpy as np

from meshcone.assets.foreign.off_words import read_words
from meshcone.assets.foreign.places import Columns, Places, TextVectors
from meshcone.assets.foreign.polygons import Polygons, check_corners
from meshcone.assets.foreign.text import (
    Line,
    content_lines,
    integer,
    points,
    require,
    shown,
    take,
    words_of,
)
from meshcone.assets.limits import Limits
from meshcone.errors import InputError

KEYWORD = re.compile(rb"(ST)?(C?)(N?)(4?n?)OFF(?![A-Za-z_])\s*+")


@dataclass(frozen=True)
class Head:
    """What stands before the vertices of a file.

    Attributes:
        textures, colors, normals: whether vertices carry them, as the keyword says.
        vertices, faces: how many there are.
        above: lines with content before the vertices.
    """

    textures: bool
    colors: bool
    normals: bool
    vertices: int
    faces: int
    above: int

    @property
    def numbers(self) -> int:
        """How many numbers of a vertex there are at least; its line may be wrapped before."""
        return 6 if self.normals else 3

    def columns(self, width: int) -> list[str]:
        """What the numbers of a vertex are called, of which there are as many as given."""
        texture = ["s", "t"] if self.textures and width >= self.numbers + 2 else []
        between = width - self.numbers - len(texture)
        shades = ["red", "green", "blue", "alpha"][:between] if self.colors and between > 2 else []
        first = ["x", "y", "z", "nx", "ny", "nz"][: self.numbers] + shades
        more = [f"column_{place + 1}" for place in range(len(first), width - len(texture))]
        return [*first, *more, *texture][:width]


def read_off(data: bytes, limits: Limits) -> Polygons:
    """Read an ASCII OFF file; colours, normals and texture coordinates are passed over.

    Where its lines are not those of vertices and faces, but its words are as many as it declares,
    it is read word by word; then nobody here can say where its vertices are.

    Raises:
        InputError: with the line at fault.
        LimitError: it declares more than ``limits`` accept.
    """
    try:
        polygons = _read_lines(data, limits)
    except InputError:
        found = _read_words(data, limits)
        if found is None:
            raise
        return found
    if _may_wrap_counts(data, limits):
        # The number of edges may be in a line of its own, and is then of no vertex.
        return _read_words(data, limits) or polygons
    return polygons


def _read_words(data: bytes, limits: Limits) -> Polygons | None:
    lines = content_lines(data, limits, comments=True)
    number, text = next(lines, (1, b""))
    keyword = KEYWORD.match(text)
    # Texture coordinates and colours are as many numbers as the lines tell.
    if keyword is None or keyword[1] or keyword[2] or keyword[4]:
        return None
    rest = chain([(number, text[keyword.end() :])], lines)
    return read_words(rest, 6 if keyword[3] else 3, limits)


def _may_wrap_counts(data: bytes, limits: Limits) -> bool:
    """Whether there are two counts in their line, and one word in the next."""
    texts = (text for _, text in content_lines(data, limits, comments=True))
    counts = KEYWORD.sub(b"", next(texts, b""), count=1) or next(texts, b"")
    return len(counts.split(None, 2)) == 2 and len(next(texts, b"").split(None, 1)) == 1


def _read_lines(data: bytes, limits: Limits) -> Polygons:
    head, lines = read_head(data, limits)
    positions = points(take(lines, head.vertices, "vertices", head.numbers))
    places: list[int] = []
    sizes: list[int] = []
    corners: list[int] = []
    for line in islice(lines, head.faces):
        found = _corners(line, lines, limits, len(corners) - 2 * len(sizes))
        places.append(line[0])
        sizes.append(len(found))
        corners += found
    require(head.faces, "faces", places)
    polygons = Polygons(
        positions,
        np.array(corners, dtype=np.int64),
        np.array(sizes, dtype=np.int64),
        _places(head.above, head.vertices, has_normals=head.normals),
    )
    place = partial(_line, places)
    check_corners(polygons.corners, polygons.sizes, head.vertices, place)
    return polygons


def read_head(data: bytes, limits: Limits) -> tuple[Head, Iterator[Line]]:
    """Read up to the vertices, and give the lines that follow.

    Raises:
        InputError: with the line at fault.
        LimitError: it declares more than ``limits`` accept.
    """
    lines = content_lines(data, limits, comments=True)
    number, text = next(lines, (1, b""))
    keyword = KEYWORD.match(text)
    if keyword is None:
        raise InputError(f"expected 'OFF', found '{shown(text)}'", place=f"line {number}")
    counts = text[keyword.end() :]
    above = 1 if counts else 2  # lines before the vertices
    if keyword[4] or counts.startswith(b"BINARY"):
        raise InputError(
            f"'{shown(text)}' is not supported; expected a three-dimensional ASCII OFF",
            place=f"line {number}",
        )
    if not counts:
        ((number, counts),) = take(lines, 1, "line of counts")
    vertices, faces = _counts(counts, number, limits)
    textures, colors, normals = (bool(keyword[group]) for group in (1, 2, 3))
    return Head(textures, colors, normals, vertices, faces, above), lines


def _line(places: list[int], row: int) -> str:
    return f"line {places[row]}"


def _places(above: int, vertices: int, *, has_normals: bool) -> Places:
    words = 6 if has_normals else 3

    def vectors(columns: Columns, *, directions: bool) -> TextVectors:
        return TextVectors(0, above, vertices, columns, words, comments=True, directions=directions)

    return Places(
        vectors((0, 1, 2), directions=False),
        vectors((3, 4, 5), directions=True) if has_normals else None,
    )


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


def _corners(line: Line, following: Iterator[Line], limits: Limits, triangles: int) -> list[int]:
    number, text = line
    size = integer(text.split(None, 1)[0], number, "a number of corners")
    if size < 0:
        raise InputError(f"expected a number of corners, found {size}", place=f"line {number}")
    # Counted before the line is cut into words: it may hold any number of them.
    limits.check("faces", triangles + size - 2, "triangles", f"line {number}")
    words = words_of(line, following, size + 1)[1:]
    if len(words) < size:
        raise InputError(f"expected {size} corners, found {len(words)}", place=f"line {number}")
    return [integer(word, number, "the index of a vertex") for word in words]
