"""Writes an OBJ file with its faces divided, and nothing else of it changed.

New v, vt and vn statements follow the last of their kind before the first face that names
them. A statement of a face that is divided becomes statements of the triangles it has become,
where it stood, so that they are of its object, group, material and smoothing group.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from meshcone.assets.number_style import NumberStyle
from meshcone.assets.obj.content import ObjTriangles
from meshcone.assets.obj.numbers import parse_number
from meshcone.assets.obj.renumber import Insertion, renumbered
from meshcone.assets.obj.scan import ObjLines
from meshcone.assets.obj.write import number_style
from meshcone.surface.arrays import Bools, Floats, Ints, row_lengths
from meshcone.surface.subdivision import DividedFaces, Subdivision
from meshcone.text import BYTE_ORDER_MARK

_LINE_END = re.compile(rb"\r\n|\r|\n")
_MOST_COLUMNS = 8  # of a statement: three coordinates, a weight, and a colour with its opacity
_COLORED = 6  # columns that have a colour
_NEEDED = {b"v": 3, b"vt": 1, b"vn": 3}
_NO_DIRECTION = 1e-6  # length of the mean of unit normals that cancel out
# Of texture coordinates: a hundred-millionth of a tile, or as much of the largest.
_FEWEST_DECIMALS, _FEWEST_DIGITS = 8, 10
_EXACT = NumberStyle(fixed=False, digits=17)


def divided_obj(
    lines: ObjLines,
    triangles: ObjTriangles,
    kept: Ints,
    subdivision: Subdivision,
    *,
    unknown: bool,
) -> bytes:
    """Write a file with the faces of its surface divided, and every vertex where it was.

    Args:
        lines: the file.
        triangles: all that it draws.
        kept: (m,) the triangle that each face of the surface is.
        subdivision: of these faces.
        unknown: whether a face names what the file does not have.
    """
    divided = kept[subdivision.divided]
    touched = np.isin(triangles.statements, triangles.statements[divided])
    whole = _of_triangles(subdivision, kept, touched)
    statements = triangles.statements[touched][whole.parents]
    tables = [
        _Table.of(lines, keyword, rows, whole.over(corners[touched], len(rows)), statements)
        for keyword, rows, corners in (
            (b"v", lines.vertices, triangles.vertices),
            (b"vt", lines.texcoords, triangles.texcoords),
            (b"vn", lines.normals, triangles.normals),
        )
    ]
    insertions = [each.insertion for each in tables]
    line_end = found[0] if (found := _LINE_END.search(lines.data)) else b"\n"
    changed = renumbered(lines, insertions, statements, unknown=unknown)
    changed |= _faces(lines, statements, [each.corners for each in tables], line_end)
    for table in tables:
        for row, stated in table.stated():
            before = _ended(lines.raw(row), line_end)
            changed[row] = before + b"".join(each + line_end for each in stated)
    return lines.replaced(changed)


def _of_triangles(subdivision: Subdivision, kept: Ints, touched: Bools) -> Subdivision:
    """The subdivision of the triangles of some statements.

    Triangles that are no face of the surface, for want of an area, are not divided.
    """
    rows = np.where(touched, np.cumsum(touched) - 1, -1)
    return subdivision.renumbered(rows[kept], int(np.count_nonzero(touched)))


@dataclass(frozen=True)
class _Table:
    """Statements of one kind that divided faces need besides those there are.

    Attributes:
        keyword: v, vt or vn.
        values: (k, c) what each states; NaN in columns that it lacks.
        insertion: where they go.
        corners: (f, 3) number of each corner's statement in the new file, from 0; -1 for none.
        style: how the first three numbers are written.
    """

    keyword: bytes
    values: Floats
    insertion: Insertion
    corners: Ints
    style: NumberStyle

    @staticmethod
    def of(
        lines: ObjLines, keyword: bytes, rows: Ints, divided: DividedFaces, statements: Ints
    ) -> _Table:
        """Interpolate what some faces need.

        Args:
            lines: the file.
            keyword: of the statements.
            rows: (r,) those there are.
            divided: the faces over them; a corner without any is -1.
            statements: (f,) that each of the faces comes from.
        """
        count = len(rows)
        used = np.unique(divided.corners[divided.corners >= 0])
        numbers = _numbers(lines, rows[used])
        between = replace(divided, corners=np.searchsorted(used, divided.corners))
        values = between.interpolated(numbers) if len(used) else np.empty((0, _MOST_COLUMNS))
        needed = np.isfinite(values[:, : _NEEDED[keyword]])
        given = np.flatnonzero((divided.corners >= 0).all(axis=1) & needed.all(axis=1))
        values, ends = values[given], numbers[between.corners[given]]
        if keyword == b"vn":
            values = _directions(values, ends[:, 0])
        if keyword == b"v":  # a weight is no part of a colour
            columns = np.isfinite(ends).sum(axis=2)
            mixed = columns.min(axis=1) != columns.max(axis=1)
            values[mixed & (columns.min(axis=1) < _COLORED), 3:] = np.nan
        insertion = Insertion(rows, _places(rows, divided, statements)[given])
        numbered = np.full(count + len(divided.corners) + 1, -1)
        numbered[:count] = insertion.numbers()[:count]
        numbered[count + given] = insertion.numbers()[count:]
        corners = numbered[divided.faces]  # the last of them is for corners without any
        style = _style(lines, keyword, rows, numbers, values)
        if keyword == b"v" and _joins(style, ends, values):
            style = _EXACT
        return _Table(keyword, values, insertion, corners, style)

    def stated(self) -> Iterable[tuple[int, list[bytes]]]:
        """The new statements that follow each of some rows."""
        order = np.argsort(self.insertion.after, kind="stable")
        ends = np.flatnonzero(np.diff(self.insertion.after[order], append=-1)) + 1
        written = _written(self.keyword, self.values[order], self.style)
        start = 0
        for end in ends.tolist():
            last = int(self.insertion.after[order[start]])
            yield int(self.insertion.rows[last - 1]), written[start:end]
            start = end


def _places(rows: Ints, divided: DividedFaces, statements: Ints) -> Ints:
    """(k,) how many of some statements stand before each new one.

    It follows the last of its kind before the first face that names it, and those it lies between.
    """
    first_use = np.full(len(rows) + len(divided.corners), np.iinfo(np.int64).max)
    new = divided.faces >= len(rows)
    np.minimum.at(first_use, divided.faces[new], np.repeat(statements, 3)[new.ravel()])
    before = np.searchsorted(rows, first_use[len(rows) :])
    return np.asarray(np.maximum(before, divided.corners.max(axis=1, initial=0) + 1))


def _numbers(lines: ObjLines, rows: Ints) -> Floats:
    """(k, c) leading numbers of some statements; NaN from the first word on that is none."""
    numbers = np.full((len(rows), _MOST_COLUMNS), np.nan)
    for place, row in enumerate(rows.tolist()):
        for column, word in enumerate(lines.leading_words(row, _MOST_COLUMNS + 1)[1:]):
            if (number := parse_number(word)) is None:
                break
            numbers[place, column] = number
    return numbers


def _directions(means: Floats, ends: Floats) -> Floats:
    """Unit vectors along means of normals; along one of these, where they cancel out."""
    lengths = row_lengths(means[:, :3])
    cancelled = lengths <= _NO_DIRECTION
    means[cancelled] = ends[cancelled]
    lengths = row_lengths(means[:, :3])
    means[:, :3] /= np.where(lengths > 0, lengths, 1.0)[:, None]
    return means


def _style(
    lines: ObjLines, keyword: bytes, rows: Ints, numbers: Floats, values: Floats
) -> NumberStyle:
    style = number_style(lines, rows)
    if keyword == b"v":
        both = np.concatenate([numbers[:, :3], values[:, :3]])
        return style.resolving(both) if len(both) else style
    if keyword == b"vn":
        return style.for_normals()
    return replace(
        style, digits=max(style.digits, _FEWEST_DECIMALS if style.fixed else _FEWEST_DIGITS)
    )


def _joins(style: NumberStyle, ends: Floats, values: Floats) -> bool:
    """Whether points (k, c), as they are written, fall on what they lie between, (k, 3, c)."""
    words = [style.format % number for number in values[:, :3].ravel().tolist()]
    rounded = np.array(words, dtype=np.float64).reshape(-1, 1, 3)
    return bool((rounded == ends[:, :, :3]).all(axis=2).any())


def _written(keyword: bytes, values: Floats, style: NumberStyle) -> list[bytes]:
    counts = np.isfinite(values).sum(axis=1).tolist()
    first, rest = style.format, b"%.9g"
    statements = []
    for numbers, count in zip((values + 0.0).tolist(), counts, strict=True):
        words = [first % number for number in numbers[: min(count, 3)]]
        words += [rest % number for number in numbers[3:count]]
        statements.append(b" ".join([keyword, *words]))
    return statements


def _faces(
    lines: ObjLines, statements: Ints, tables: list[Ints], line_end: bytes
) -> dict[int, bytes]:
    """Statements of faces, by the row they take the place of."""
    words: dict[int, list[bytes]] = {}
    v, vt, vn = ((table + 1).tolist() for table in tables)
    for row, *corners in zip(statements.tolist(), v, vt, vn, strict=True):
        named = [_corner(*indices) for indices in zip(*corners, strict=True)]
        words.setdefault(row, []).append(b" ".join([b"f", *named]))
    return {row: _in_place_of(lines.raw(row), each, line_end) for row, each in words.items()}


def _corner(v: int, vt: int, vn: int) -> bytes:
    if vn:
        return b"%d/%b/%d" % (v, b"%d" % vt if vt else b"", vn)
    return b"%d/%d" % (v, vt) if vt else b"%d" % v


def _in_place_of(statement: bytes, faces: list[bytes], line_end: bytes) -> bytes:
    """Lines of faces that keep a statement's comment and the end of its line."""
    content = statement.rstrip(b"\r\n")
    mark = BYTE_ORDER_MARK if content.startswith(BYTE_ORDER_MARK) else b""
    _, sign, comment = content.partition(b"#")
    faces = [faces[0] + (b" #" + comment if sign else b""), *faces[1:]]
    return mark + line_end.join(faces) + statement[len(content) :]


def _ended(statement: bytes, line_end: bytes) -> bytes:
    """A statement with the end of its line, which the last of a file may lack."""
    if _LINE_END.search(statement[-1:]):
        return statement
    # A backslash would continue it on the next line.
    return statement + (2 * line_end if statement.endswith(b"\\") else line_end)
