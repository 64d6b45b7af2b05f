"""What the vertices and faces of a PLY file carry besides places."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import TypeVar

import numpy as np

from meshcone.assets.content import Attribute
from meshcone.assets.foreign.carried import Carried, Table, of_faces, of_vertices, upwards
from meshcone.assets.foreign.ply import body_of, corner_list
from meshcone.assets.foreign.ply_ascii import AsciiBody
from meshcone.assets.foreign.ply_binary import BinaryBody
from meshcone.assets.foreign.ply_header import Element, Header, read_header
from meshcone.assets.limits import Limits
from meshcone.errors import MeshConeError
from meshcone.surface.arrays import Floats, Ints

TEXTURE = b"texcoord"  # two numbers of a face for each of its corners (MeshLab)
_COORDINATES = "TEXCOORD_0"

T = TypeVar("T")


def carried_by_ply(
    data: bytes, limits: Limits, triangles: Ints, faces: Ints, slots: Ints
) -> Carried:
    """What the corners of triangles have.

    Args:
        data: the file.
        limits: that it was read under.
        triangles: (k, 3) vertices at the corners.
        faces: (k,) the face each is a part of; those of strips come after all faces.
        slots: (k, 3) which corner of the face each corner is.
    """
    header = read_header(data, limits)
    elements = {element.name: element for element in header.elements}
    file = _File(data, header, limits)
    carried = of_vertices(file.table(elements[b"vertex"]), triangles)
    attributes, others = dict(carried.attributes), dict(carried.others)
    unread = [f"_{name}" for name in _lists(elements[b"vertex"])]
    width = carried.width
    face = elements.get(b"face")
    if face is not None and face.count:
        rows = np.where(faces < face.count, faces, -1)
        others |= of_faces(file.table(face), np.repeat(rows[:, None], 3, axis=1))
        texture = file.texture(face, faces, slots) if _COORDINATES not in attributes else None
        if texture is not None:
            attributes[_COORDINATES] = texture
            width += 2
        left = [name for name in _lists(face) if texture is None or name != TEXTURE.decode()]
        unread += [f"_FACE_{name}" for name in left]
    return Carried(attributes, others, tuple(name.upper() for name in unread), width)


def _lists(element: Element) -> list[str]:
    """What its lists are called, but for that of its corners."""
    corners = corner_list(element) if element.name == b"face" else -1
    return [
        _decoded(item.name)
        for place, item in enumerate(element.properties)
        if item.length is not None and place != corners
    ]


def _decoded(name: bytes) -> str:
    return name.decode("utf-8", "replace")


class _File:
    """Reads elements of a file that has been read, each anew."""

    def __init__(self, data: bytes, header: Header, limits: Limits) -> None:
        self._data, self._header, self._limits = data, header, limits

    def table(self, element: Element) -> Table:
        """The numbers of an element."""
        numbers = {
            _decoded(item.name): (place, item.values)
            for place, item in enumerate(element.properties)
            if item.length is None
        }
        places = [place for place, _ in numbers.values()]
        return Table(
            {name: kind for name, (_, kind) in numbers.items()},
            partial(self._numbers, element, places),
        )

    def texture(self, element: Element, faces: Ints, slots: Ints) -> Attribute | None:
        """Texture coordinates of the corners of faces; None where no corner has any."""
        places = {item.name: n for n, item in enumerate(element.properties) if item.length}
        if TEXTURE not in places:
            return None
        values, sizes = self._at(element, lambda body: body.lists(element, places[TEXTURE]))
        starts = np.concatenate([np.cumsum(sizes) - sizes, [0]])
        sizes = np.concatenate([sizes, [0]])  # a face of a strip has none
        owners = np.minimum(faces, len(sizes) - 1)[:, None]
        has = 2 * slots + 1 < sizes[owners]
        if not has.any():
            return None
        corners = np.where(has, starts[owners] + 2 * slots, -1)

        def stored(rows: Ints) -> Floats:
            return np.stack([values[rows], values[rows + 1]], axis=1)

        return Attribute(_COORDINATES, corners, lambda rows: upwards(stored(rows)), stored=stored)

    def _numbers(self, element: Element, places: Sequence[int]) -> Floats:
        try:
            return self._at(element, lambda body: body.numbers(element, places))
        except MeshConeError:  # rows of a text that are cut off: no surface needs them
            return np.full((element.count, len(places)), np.nan)

    def _at(self, element: Element, read: Callable[[AsciiBody | BinaryBody], T]) -> T:
        body = body_of(self._data, self._header, self._limits)
        for each in self._header.elements:
            if each.name == element.name:
                break
            body.skip(each)
        return read(body)
