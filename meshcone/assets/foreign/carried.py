"""What the vertices and faces of a PLY or OFF file carry besides places, in glTF's words."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any

import numpy as np

from meshcone.assets.content import Attribute
from meshcone.srgb import to_linear
from meshcone.surface.arrays import Floats, Ints

_BYTE = 255.0
# What columns that belong together are called, and what they are in glTF; the first that is whole.
_NORMALS = (("nx", "ny", "nz"),)
_TEXTURES = (("s", "t"), ("u", "v"), ("texture_u", "texture_v"), ("texture_s", "texture_t"))
_COLOURS = tuple(
    tuple(prefix + channel for channel in channels)
    for prefix, channels in (
        ("", ("red", "green", "blue", "alpha")),
        ("diffuse_", ("red", "green", "blue", "alpha")),
        ("", ("r", "g", "b", "a")),
    )
)
_PLACE = ("x", "y", "z")


class Table:
    """Numbers of each vertex or of each face, read when they are first asked for.

    Args:
        columns: what each is called, in order, and the type it has; None in a text without types.
        read: gives the (r, c) numbers; NaN where a row has none.
    """

    def __init__(
        self, columns: Mapping[str, np.dtype[Any] | None], read: Callable[[], Floats]
    ) -> None:
        self.columns = columns
        self._read = read

    @cached_property
    def values(self) -> Floats:
        """(r, c) numbers as the file has them."""
        return self._read()

    def some(self, names: Sequence[str]) -> Floats:
        """(r, k) some of its columns."""
        order = list(self.columns)
        return self.values[:, [order.index(name) for name in names]]

    def is_whole(self, names: Sequence[str]) -> bool:
        """Whether columns are stored as whole numbers."""
        kinds = [self.columns[name] for name in names]
        if any(kind is None for kind in kinds):
            found = self.some(names)
            return bool((np.isnan(found) | (found == np.rint(found))).all())
        return all(kind is not None and kind.kind != "f" for kind in kinds)


@dataclass(frozen=True)
class Carried:
    """What the corners of a file's triangles have besides a place.

    Attributes:
        attributes: normals, coordinates and colours, by glTF's names.
        others: what is of no such kind, each called after its column: ``_QUALITY``.
        unread: names of lists, of whose values nothing is known.
        width: numbers that a vertex has of ``attributes``.
    """

    attributes: Mapping[str, Attribute] = field(default_factory=dict)
    others: Mapping[str, Attribute] = field(default_factory=dict)
    unread: tuple[str, ...] = ()
    width: int = 0

    @property
    def names(self) -> tuple[str, ...]:
        """What there is besides places."""
        return tuple(sorted({*self.attributes, *self.others, *self.unread}))


def of_vertices(table: Table, corners: Ints) -> Carried:
    """What vertices carry.

    Args:
        table: of all numbers they have, those of their places among them.
        corners: (k, 3) rows of it, at the corners of triangles.
    """
    left = [name for name in table.columns if name not in _PLACE]
    found: dict[str, Attribute] = {}
    width = 0
    for name, choices, least, made in (
        ("NORMAL", _NORMALS, 3, _plain),
        ("TEXCOORD_0", _TEXTURES, 2, _coordinates),
        ("COLOR_0", _COLOURS, 3, _colours),
    ):
        for choice in choices:
            columns = [each for each in choice if each in left]
            if tuple(columns[:least]) == choice[:least]:
                found[name] = made(name, table, columns, corners)
                left = [each for each in left if each not in columns]
                width += len(columns)
                break
    others = dict(_others(table, left, corners, "_"))
    return Carried(found, others, width=width)


def of_faces(table: Table, corners: Ints) -> Iterator[tuple[str, Attribute]]:
    """What faces carry, each number by itself; see :func:`of_vertices`."""
    yield from _others(table, list(table.columns), corners, "_FACE_")


def _others(
    table: Table, names: Sequence[str], corners: Ints, prefix: str
) -> Iterator[tuple[str, Attribute]]:
    for name in names:
        called = prefix + name.upper()
        yield called, _plain(called, table, [name], corners)


def _plain(name: str, table: Table, columns: Sequence[str], corners: Ints) -> Attribute:
    return Attribute(name, corners, partial(_rows, table, tuple(columns)))


def _coordinates(name: str, table: Table, columns: Sequence[str], corners: Ints) -> Attribute:
    stored = partial(_rows, table, tuple(columns))
    return Attribute(name, corners, lambda rows: upwards(stored(rows)), stored=stored)


def _colours(name: str, table: Table, columns: Sequence[str], corners: Ints) -> Attribute:
    full = _full(table, columns)
    step = 1.0 / full if full > 1 and table.is_whole(columns) else 0.0

    def stored(rows: Ints) -> Floats:
        return _rows(table, tuple(columns), rows) / full

    def read(rows: Ints) -> Floats:
        # As tools write them they are sRGB; in glTF, whose words these are, they are linear.
        found = stored(rows)
        found[:, :3] = to_linear(found[:, :3])
        return found

    return Attribute(name, corners, read, step, stored)


def upwards(coordinates: Floats) -> Floats:
    """(r, 2) coordinates of glTF, whose v runs downwards, for those of PLY and OFF."""
    return np.asarray(coordinates * (1.0, -1.0) + (0.0, 1.0))


def _full(table: Table, columns: Sequence[str]) -> float:
    """What number stands for all of a colour."""
    kind = table.columns[columns[0]]
    if kind is not None and kind.kind == "u":
        return float(np.iinfo(kind).max) if kind.itemsize < 4 else _BYTE
    if kind is not None and kind.kind == "i":
        return _BYTE
    largest = np.nanmax(table.some(columns), initial=0.0)
    return _BYTE if largest > 1 else 1.0


def _rows(table: Table, columns: tuple[str, ...], rows: Ints) -> Floats:
    return table.some(columns)[rows]
