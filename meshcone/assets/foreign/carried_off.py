"""What the vertices and faces of an OFF file carry besides places."""

from __future__ import annotations

from itertools import islice

import numpy as np

from meshcone.assets.content import Attribute
from meshcone.assets.foreign.carried import Carried, Table, of_vertices
from meshcone.assets.foreign.off import read_head
from meshcone.assets.foreign.text import columns_of, number_or_nan, take, words_of
from meshcone.assets.limits import Limits
from meshcone.surface.arrays import Floats, Ints

_SHADES = 4  # numbers after the corners of a face
_FACES = "_FACE_COLOR"


def carried_by_off(data: bytes, limits: Limits, triangles: Ints, faces: Ints) -> Carried:
    """What the corners of triangles have.

    Args:
        data: the file.
        limits: that it was read under.
        triangles: (k, 3) vertices at the corners.
        faces: (k,) the face each is a part of.
    """
    head, lines = read_head(data, limits)
    rows = take(lines, head.vertices, "vertices", head.numbers)
    names = head.columns(len(rows[0][1].split()) if rows else 0)
    table = Table(dict.fromkeys(names), lambda: columns_of(rows, range(len(names))))
    carried = of_vertices(table, triangles)
    shades = np.full((head.faces, _SHADES), np.nan)
    for row, line in enumerate(islice(lines, head.faces)):
        size = int(line[1].split(None, 1)[0])
        words = line[1].split()
        if len(words) <= size:  # wrapped
            words = words_of(line, lines, size + 1)
        own = words[size + 1 : size + 1 + _SHADES]
        shades[row, : len(own)] = [number_or_nan(word) for word in own]
    has = ~np.isnan(shades).all(axis=1)
    if not has.any():
        return carried
    return Carried(
        carried.attributes,
        {**carried.others, _FACES: _of_faces(shades, has, faces)},
        width=carried.width,
    )


def _of_faces(shades: Floats, has: np.ndarray, faces: Ints) -> Attribute:
    corners = np.repeat(np.where(has[faces], faces, -1)[:, None], 3, axis=1)
    return Attribute(_FACES, corners, lambda rows: shades[rows])
