"""Divides the faces of a PLY file, with every property of vertices and faces."""

from __future__ import annotations

import re

import numpy as np

from meshcone.assets.foreign.divide import (
    DividedPolygons,
    ForeignTriangles,
    Span,
    after_line,
    between,
    content_spans,
    directions,
    replaced,
    row_spans,
)
from meshcone.assets.foreign.ply import NORMAL, corner_list
from meshcone.assets.foreign.ply_ascii import AsciiBody
from meshcone.assets.foreign.ply_binary import BinaryBody
from meshcone.assets.foreign.ply_header import Element, Header, Property, read_header
from meshcone.assets.foreign.text import shown
from meshcone.assets.foreign.whole import Whole, has_no_sign, lengthened, whole_columns
from meshcone.assets.limits import Limits
from meshcone.assets.number_style import NumberStyle
from meshcone.errors import InputError
from meshcone.surface.arrays import Floats, Ints
from meshcone.surface.subdivision import Subdivision

_PLACE = (b"x", b"y", b"z")
_TEXTURE = b"texcoord"  # two numbers of a face for each of its corners (MeshLab)
# Whole numbers that something lies between.
_SHADES = re.compile(rb"(?:.*_)?(?:red|green|blue|alpha|intensity|quality|confidence|[rgba])")

# What a row has of each property: of text its words, else its bytes.
Row = list[list[bytes]]


def divided_ply(
    data: bytes, limits: Limits, triangles: ForeignTriangles, subdivision: Subdivision
) -> bytes:
    """Write a file with faces divided, and every vertex where it was.

    New vertices follow those there are, with every property interpolated: numbers of a colour
    are rounded where they are whole, normals are of length 1, or as long as those around them
    where they are whole. A face's properties are those of each of its parts.

    Raises:
        InputError: strips of triangles are divided, a list of a face cannot be, or a whole number
            that is no shade differs along an edge to divide.
    """
    header = read_header(data, limits)
    table = _Text(data, header) if header.encoding == "ascii" else _Binary(data, header, limits)
    vertex, face = _element(header, b"vertex"), _element(header, b"face")
    polygons = triangles.divided(subdivision, vertex.count)
    if len(polygons.rows) and polygons.rows[-1] >= face.count:
        raise _of_strips()
    changes = {(table.end, table.end): _vertices(table, vertex, polygons)}
    added = _faces(table, face, triangles, polygons, changes)
    start = header.size
    head = _counted(data[:start], vertex, len(polygons.over.corners))
    return _counted(head, face, added) + replaced(data, start, changes)[start:]


def require_divisible(data: bytes, limits: Limits) -> None:
    """Check what can be known before it is known which faces are divided.

    Raises:
        InputError: it has strips of triangles alone, or a row lacks what the header declares.
    """
    header = read_header(data, limits)
    if b"face" not in {element.name for element in header.elements if element.count}:
        raise _of_strips()
    if header.encoding == "ascii":
        body = AsciiBody(data[header.size :], header.lines + 1, limits)
        for element in header.elements:
            check = body.require_whole if element.name in (b"vertex", b"face") else body.skip
            check(element)


def _of_strips() -> InputError:
    words = "triangles of a strip cannot be divided: save the mesh with faces"
    return InputError(words, place="element tristrips")


def carries_properties(data: bytes, limits: Limits) -> bool:
    """Whether faces have properties besides their corners."""
    header = read_header(data, limits)
    return any(len(each.properties) > 1 for each in header.elements if each.name == b"face")


def _element(header: Header, name: bytes) -> Element:
    return next(each for each in header.elements if each.name == name)


def _counted(head: bytes, element: Element, added: int) -> bytes:
    """A header with another number of an element's rows."""
    pattern = rb"((?:^|[\r\n])[ \t]*element[ \t]+%s[ \t]+)\d+" % re.escape(element.name)
    return re.sub(pattern, rb"\g<1>%d" % (element.count + added), head, count=1)


def _vertices(table: _Text | _Binary, element: Element, polygons: DividedPolygons) -> bytes:
    """The rows of new vertices."""
    names = [item.name for item in element.properties]
    values, ends = between(polygons.over, table.numbers)
    kinds = [item.values for item in element.properties]
    whole = whole_columns(kinds, ends[:, :, : len(kinds)].reshape(-1, len(kinds)))
    vectors = set(_PLACE)
    if all(name in names for name in NORMAL):
        columns = [names.index(name) for name in NORMAL]
        types = tuple(whole[column] for column in columns)
        if not has_no_sign(types):
            vectors |= set(NORMAL)
            values[:, columns] = _normals(values[:, columns], ends[:, :, columns], types)
    for column, item in enumerate(element.properties):
        if whole[column] is None:
            continue
        apart = (ends[:, :, column] != ends[:, :1, column]).any()
        if apart and item.name not in vectors and not _SHADES.fullmatch(item.name):
            raise InputError(
                f"'{shown(item.name)}' differs along an edge to divide, and no whole number lies "
                "between two that are no shades",
                place=element.place,
            )
        values[:, column] = np.rint(values[:, column])
    return table.rows_of(values, element, whole)


def _normals(means: Floats, ends: Floats, types: Whole) -> Floats:
    """Directions along means (p, 3) of normals, which are as long as the longest of these."""
    lengths = np.linalg.norm(ends, axis=2)
    longest = np.take_along_axis(ends, lengths.argmax(axis=1)[:, None, None], axis=1)[:, 0]
    return lengthened(directions(means, ends[:, 0]), longest, types)


def _faces(
    table: _Text | _Binary,
    element: Element,
    triangles: ForeignTriangles,
    polygons: DividedPolygons,
    changes: dict[Span, bytes],
) -> int:
    """Put the triangles of each divided face in its place; how many faces more that is."""
    corners = corner_list(element)
    whole = polygons.subdivision
    weights = whole.places / 2.0**whole.exponent
    owners = whole.owners
    slots = triangles.corners[polygons.touched]
    count = 0
    for row, children in polygons.groups():
        span, parts = table.face(row)
        texture = _texture(table, element, parts, row)
        written = []
        for child in children.tolist():
            parts[corners] = table.listed(element.properties[corners], polygons.over.faces[child])
            if texture is not None:
                place, found = texture
                near = found[slots[owners[child]]]
                inside = np.einsum("cp,cpk->ck", weights[child], near)
                parts[place] = table.listed(element.properties[place], inside.ravel())
            written.append(table.joined(parts))
        changes[span] = table.between_rows.join(written)
        count += len(written) - 1
    return count


def _texture(
    table: _Text | _Binary, element: Element, parts: Row, row: int
) -> tuple[int, Floats] | None:
    """Texture coordinates (c, 2) that a face has for its corners, and their property."""
    lists = [place for place, item in enumerate(element.properties) if item.length is not None]
    size = len(table.listing(element.properties[corner_list(element)], parts[corner_list(element)]))
    found = None
    for place in lists:
        item = element.properties[place]
        if place == corner_list(element):
            continue
        values = table.listing(item, parts[place])
        if item.name != _TEXTURE or len(values) != 2 * size or item.values.kind != "f":
            if not len(values):
                continue
            raise InputError(
                f"the list '{shown(item.name)}' of a face to divide may have a value for each of "
                "its corners, and new corners have none",
                place=f"{element.place}, row {row}",
            )
        found = place, values.reshape(-1, 2)
    return found


class _Text:
    """The rows of vertices and faces of a text."""

    def __init__(self, data: bytes, header: Header) -> None:
        self._data = data
        lines = content_spans(data, header.size, comments=False)
        spans = {
            element.name: row_spans(lines, data, element.count)
            for element in header.elements
            if element.properties
        }
        self._vertices, self._faces = spans[b"vertex"], spans[b"face"]
        self._element = _element(header, b"face")
        self.between_rows, self.end = after_line(data, self._vertices[-1][1])

    def numbers(self, rows: Ints) -> Floats:
        """What some vertices have, (k, properties)."""
        found = []
        for row in rows.tolist():
            start, end = self._vertices[row]
            try:
                found.append([float(word) for word in self._data[start:end].split()])
            except ValueError:
                place = f"element vertex, row {row}"
                words = "a property of a vertex beside new ones is no number"
                raise InputError(words, place=place) from None
        width = min(map(len, found), default=0)
        return np.array([each[:width] for each in found])

    def rows_of(self, values: Floats, element: Element, whole: Whole) -> bytes:
        """New rows of vertices, and which of their columns are of whole numbers."""
        names = [item.name for item in element.properties]
        place = [names.index(name) for name in _PLACE]
        step = max(1, len(self._vertices) // 20_000)
        words = [self._data[start:end].split() for start, end in self._vertices[::step]]
        style = NumberStyle.of(each[column] for each in words for column in place)
        if len(values):
            style = style.resolving(values[:, place])
        formats = [
            b"%d" if kind is not None else style.format if item.name in _PLACE else b"%.9g"
            for item, kind in zip(element.properties, whole, strict=True)
        ]
        written = [b" ".join(f % v for f, v in zip(formats, row, strict=False)) for row in values]
        return b"".join(each + self.between_rows for each in written)

    def face(self, row: int) -> tuple[Span, Row]:
        """Where a face is, and its words."""
        start, end = self._faces[row]
        words = iter(self._data[start:end].split())
        parts: Row = []
        for item in self._element.properties:
            first = [next(words)]
            size = int(first[0]) if item.length is not None else 0
            parts.append(first + [next(words) for _ in range(size)])
        return (start, end), parts

    def listing(self, _: Property, part: list[bytes]) -> Floats:
        """The values of a list."""
        return np.array(part[1:], dtype=np.float64)

    def listed(self, item: Property, values: Floats | Ints) -> list[bytes]:
        """A list with these values."""
        form = b"%.9g" if item.values.kind == "f" else b"%d"
        return [b"%d" % len(values), *(form % value for value in values.tolist())]

    def joined(self, parts: Row) -> bytes:
        """A row of these parts."""
        return b" ".join(word for part in parts for word in part)


class _Binary:
    """The rows of vertices and faces of bytes."""

    between_rows = b""

    def __init__(self, data: bytes, header: Header, limits: Limits) -> None:
        self._data = data
        body = BinaryBody(data, header.size, limits)
        extents = {each.name: body.extents(each) for each in header.elements if each.properties}
        self._vertices, self._faces = extents[b"vertex"], extents[b"face"]
        self._vertex, self._element = (_element(header, name) for name in (b"vertex", b"face"))
        self.end = int(self._vertices[-1])

    def numbers(self, rows: Ints) -> Floats:
        """What some vertices have, (k, properties)."""
        table = np.frombuffer(self._data, self._row(), self._vertex.count, int(self._vertices[0]))[
            rows
        ]
        with np.errstate(invalid="ignore"):
            return np.stack(
                [table[name].astype(np.float64) for name in self._row().names or ()], axis=1
            )

    def rows_of(self, values: Floats, element: Element, whole: Whole) -> bytes:  # noqa: ARG002
        """New rows of vertices."""
        table = np.empty(len(values), dtype=self._row())
        for column, item in enumerate(element.properties):
            table[f"f{column}"] = values[:, column].astype(item.values)
        return table.tobytes()

    def _row(self) -> np.dtype[np.void]:
        properties = enumerate(self._vertex.properties)
        return np.dtype([(f"f{place}", item.values) for place, item in properties])

    def face(self, row: int) -> tuple[Span, Row]:
        """Where a face is, and the bytes of each property."""
        place, end = int(self._faces[row]), int(self._faces[row + 1])
        span, parts = (place, end), []
        for item in self._element.properties:
            size = item.values.itemsize
            if item.length is not None:
                (length,) = np.frombuffer(self._data, item.length, 1, place)
                size = item.length.itemsize + int(length) * size
            parts.append([self._data[place : place + size]])
            place += size
        return span, parts

    def listing(self, item: Property, part: list[bytes]) -> Floats:
        """The values of a list."""
        start = 0 if item.length is None else item.length.itemsize
        return np.frombuffer(part[0], item.values, offset=start).astype(np.float64)

    def listed(self, item: Property, values: Floats | Ints) -> list[bytes]:
        """A list with these values.

        Raises:
            InputError: the type of the list's values or of its length does not hold them.
        """
        length = np.asarray([len(values)]).astype(item.length)
        stored = values.astype(item.values)
        if item.values.kind != "f" and (stored != values).any():
            raise InputError(
                f"'{shown(item.name)}' is stored as {item.values.name}, which does not hold the "
                f"numbers of {int(values.max()) + 1:,} vertices",
                place="element face",
            )
        return [length.tobytes() + stored.tobytes()]

    def joined(self, parts: Row) -> bytes:
        """A row of these parts."""
        return b"".join(part[0] for part in parts)
