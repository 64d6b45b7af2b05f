"""Reads the f statements of an OBJ file.

Source: "Object Files (.obj)", appendix B1, section "Face": a corner is ``v``, ``v/vt``,
``v//vn`` or ``v/vt/vn``; indices count from 1, negative ones backwards from the last
element stated *before* the face.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.limits import Limits
from meshcone.assets.obj.numbers import block_words, blocks, shown
from meshcone.assets.obj.scan import ObjLines, count_words
from meshcone.errors import InputError
from meshcone.notices import Code, Notice

_NONE = 0  # no OBJ index is 0, so 0 stands for "not given" until indices are resolved
_LARGEST = 2**62
_SLASH, _SPACE = b"/ "
_PLAIN: NDArray[np.bool_] = np.isin(np.arange(256), list(b"0123456789-/ "))
# numpy would take "1-2" for two numbers and "- 3" for one.
_STRAY_SIGN = re.compile(rb"\d-|-(?!\d)")
_CORNER = re.compile(rb"([+-]?\d+)(?:/([+-]?\d+)?(?:/([+-]?\d+)?)?)?")


@dataclass(frozen=True)
class ObjFaces:
    """Polygons of at least three corners.

    Attributes:
        vertices: (c,) vertex of each corner, polygon after polygon, from 0.
        texcoords: (c,) vt statement of each corner, from 0; -1 where there is none.
        normals: (c,) vn statement of each corner, likewise.
        sizes: (p,) corners per polygon.
        rows: (p,) statement of each polygon.
        warnings: references that were ignored.
    """

    vertices: NDArray[np.int64]
    texcoords: NDArray[np.int64]
    normals: NDArray[np.int64]
    sizes: NDArray[np.int64]
    rows: NDArray[np.int64]
    warnings: tuple[Notice, ...]


def read_faces(lines: ObjLines, limits: Limits) -> ObjFaces:
    """Read and resolve every face.

    Raises:
        InputError: a corner is malformed, or its vertex is 0 or not in the file.
        LimitError: the polygons make more triangles than ``limits.faces``.
    """
    sizes_found, indices_found = [], []
    triangles = 0
    for block in blocks(lines.faces):
        sizes, corners = _split_corners(lines, block, limits)
        triangles += int(np.maximum(sizes - 2, 0).sum())
        limits.check("faces", triangles, "triangles", lines.place(int(block[-1])))
        indices = _convert(corners)
        sizes_found.append(sizes)
        indices_found.append(
            _one_by_one(lines, block, sizes, corners) if indices is None else indices
        )
    sizes = np.concatenate(sizes_found or [np.zeros(0, dtype=np.int64)])
    return _resolve(lines, sizes, *np.hstack(indices_found or [np.zeros((3, 0), dtype=np.int64)]))


def _split_corners(
    lines: ObjLines, rows: NDArray[np.int64], limits: Limits
) -> tuple[NDArray[np.int64], list[bytes]]:
    """(p,) corners of each face, and the corners of all."""
    words = block_words(lines, rows)
    if words is not None and words.count(b"f") == len(rows):
        width, rest = divmod(len(words), len(rows))
        if not rest and words[::width].count(b"f") == len(rows):
            del words[::width]
            return np.full(len(rows), width - 1), words
        starts = np.array([place for place, word in enumerate(words) if word == b"f"])
        sizes = np.diff(starts, append=len(words)) - 1
        return sizes, [word for word in words if word != b"f"]
    faces = []
    triangles = 0
    for row in rows.tolist():
        statement = lines.statement(row)
        triangles += max(count_words(statement) - 3, 0)
        limits.check("faces", triangles, "triangles", lines.place(row))
        faces.append(statement.split()[1:])
    return np.array([len(face) for face in faces]), list(chain.from_iterable(faces))


def _convert(corners: list[bytes]) -> NDArray[np.int64] | None:
    """(3, c) indices of corners that all have one form; None if any needs a closer look.

    Converting joined words is what makes a million faces take a second.
    """
    joined = b" ".join([*corners, b""])
    characters = np.frombuffer(joined, dtype=np.uint8)
    if not _PLAIN[characters].all() or (b"-" in joined and _STRAY_SIGN.search(joined)):
        return None
    separators = characters[(characters == _SLASH) | (characters == _SPACE)]
    width = int(np.argmax(separators == _SPACE)) + 1 if len(corners) else 1
    if width > 3 or len(separators) != width * len(corners):
        return None
    forms = separators.reshape(-1, width)
    doubled = joined.count(b"//")
    if (forms != forms[:1]).any() or doubled not in (0, len(corners)):
        return None
    given = (0, 2) if doubled else tuple(range(width))
    try:
        numbers = np.fromstring(joined.replace(b"/", b" "), dtype=np.int64, sep=" ")
    except ValueError:
        return None
    if len(numbers) != len(given) * len(corners):
        return None
    indices = np.full((3, len(corners)), _NONE)
    indices[given, :] = numbers.reshape(-1, len(given)).T
    return indices


def _one_by_one(
    lines: ObjLines, rows: NDArray[np.int64], sizes: NDArray[np.int64], corners: list[bytes]
) -> NDArray[np.int64]:
    rows_of_corners = np.repeat(rows, sizes).tolist()
    found = [_corner(word, lines, row) for word, row in zip(corners, rows_of_corners, strict=True)]
    return np.array(found, dtype=np.int64).reshape(-1, 3).T


def _corner(word: bytes, lines: ObjLines, row: int) -> tuple[int, int, int]:
    """Indices of ``1``, ``1/2``, ``1//3`` or ``1/2/3``; empty parts are absent."""
    match = _CORNER.fullmatch(word)
    if match is None:
        raise InputError(
            f"expected a face corner like 1/2/3, found '{shown(word)}'", place=lines.place(row)
        )
    vertex, texcoord, normal = match.groups()
    return _index(vertex), _index(texcoord), _index(normal)


def _index(part: bytes | None) -> int:
    if part is None:
        return _NONE
    digits = part.lstrip(b"+-")
    magnitude = int(digits) if len(digits) < 19 else _LARGEST
    return -magnitude if part[:1] == b"-" else magnitude


def _resolve(
    lines: ObjLines,
    sizes: NDArray[np.int64],
    vertices: NDArray[np.int64],
    texcoords: NDArray[np.int64],
    normals: NDArray[np.int64],
) -> ObjFaces:
    rows = np.repeat(lines.faces, sizes)
    resolved = _absolute(vertices, rows, lines.vertices)
    outside = np.flatnonzero((resolved < 0) | (resolved >= len(lines.vertices)))
    if len(outside):
        first = outside[0]
        raise InputError(
            f"a face names vertex {vertices[first]}; {_valid_range(len(lines.vertices))}",
            place=lines.place(int(rows[first])),
        )
    warnings = []
    known = {}
    for what, code, indices, statements in (
        ("texture coordinate", Code.TEXCOORDS_UNKNOWN, texcoords, lines.texcoords),
        ("normal", Code.NORMALS_UNKNOWN, normals, lines.normals),
    ):
        known[what], unknown = _known(indices, rows, statements)
        if unknown.any():
            place = lines.place(int(rows[np.flatnonzero(unknown)[0]]))
            words = f"a face names a {what} the file does not have; ignored"
            warnings.append(Notice(code, words, place))

    whole = sizes >= 3
    if not whole.all():
        place = lines.place(int(lines.faces[~whole][0]))
        words = "a face with fewer than 3 corners; ignored"
        warnings.append(Notice(Code.FACES_TOO_FEW_CORNERS, words, place))
    kept = np.repeat(whole, sizes)
    return ObjFaces(
        vertices=resolved[kept],
        texcoords=known["texture coordinate"][kept],
        normals=known["normal"][kept],
        sizes=sizes[whole],
        rows=lines.faces[whole],
        warnings=tuple(warnings),
    )


def _known(
    indices: NDArray[np.int64], rows: NDArray[np.int64], statements: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Indices from 0, -1 for those absent or unknown; and which are unknown."""
    found = _absolute(indices, rows, statements)
    given = indices != _NONE
    unknown = given & ((found < 0) | (found >= len(statements)))
    found[~given | unknown] = -1
    return found, unknown


def _absolute(
    indices: NDArray[np.int64], rows: NDArray[np.int64], statements: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Indices from 0; those out of range stay out of range."""
    if not (indices < 0).any():
        return indices - 1
    before = np.searchsorted(statements, rows)
    return np.where(indices < 0, before + indices, indices - 1)


def _valid_range(count: int) -> str:
    return f"the file has vertices 1 to {count}" if count else "the file has no vertices"
