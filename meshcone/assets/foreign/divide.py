"""What dividing the faces of a PLY, STL or OFF file has in common."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.comments import uncommented
from meshcone.surface.arrays import Bools, Floats, Ints, row_lengths
from meshcone.surface.subdivision import DividedFaces, Subdivision

_LINE = re.compile(rb"[^\r\n]+")
_LINE_END = re.compile(rb"\r\n|\r|\n")
_SHORTEST = 1e-6  # mean of unit normals that cancel out

Span = tuple[int, int]


@dataclass(frozen=True)
class ForeignTriangles:
    """The triangles of a file, and where each came from.

    Attributes:
        rows: (k,) the polygon, as the file lists them, that each is a part of.
        corners: (k, 3) corners of that polygon, by their number in it.
        vertices: (k, 3) vertex at each corner.
        kept: (m,) the triangle that each face of the surface is.
    """

    rows: Ints
    corners: Ints
    vertices: Ints
    kept: Ints

    def divided(self, subdivision: Subdivision, count: int) -> DividedPolygons:
        """Divide the faces of the surface; polygons that are touched fall into triangles.

        Args:
            subdivision: of the faces.
            count: vertices in the file.
        """
        divided = self.kept[subdivision.divided]
        touched = np.isin(self.rows, self.rows[divided])
        numbers = np.where(touched, np.cumsum(touched) - 1, -1)
        whole = subdivision.renumbered(numbers[self.kept], int(np.count_nonzero(touched)))
        return DividedPolygons(
            rows=self.rows[touched][whole.parents],
            over=whole.over(self.vertices[touched], count),
            subdivision=whole,
            touched=touched,
        )


@dataclass(frozen=True)
class DividedPolygons:
    """What the polygons have become some part of which is divided.

    Attributes:
        rows: (f,) polygon that each new triangle takes the place of, ascending.
        over: the new triangles over the file's vertices.
        subdivision: of the triangles that the polygons were made of.
        touched: (k,) which of all triangles these are.
    """

    rows: Ints
    over: DividedFaces
    subdivision: Subdivision
    touched: Bools

    def groups(self) -> Iterator[tuple[int, NDArray[np.int64]]]:
        """Each polygon, and the rows of its triangles."""
        starts = np.flatnonzero(np.diff(self.rows, prepend=-1))
        for each in np.split(np.arange(len(self.rows)), starts[1:]):
            if len(each):
                yield int(self.rows[each[0]]), each


def content_spans(data: bytes, start: int, *, comments: bool) -> Iterator[Span]:
    """Where the content of each line is that has some, from a byte on."""
    for match in _LINE.finditer(data, start):
        text = uncommented(match[0]) if comments else match[0]
        kept = text.strip()
        if kept:
            first = match.start() + text.index(kept)
            yield first, first + len(kept)


def row_spans(
    lines: Iterator[Span], data: bytes, count: int, needed: Callable[[bytes], int] = lambda _: 1
) -> list[Span]:
    """Where each of some rows is, which goes on in the next line where it lacks words.

    Args:
        lines: where the content of each line is.
        data: the file.
        count: how many rows.
        needed: words that a row needs, by its first one.
    """
    rows = []
    for _ in range(count):
        first, end = next(lines)
        words = data[first:end].split()
        least, found = needed(words[0]), len(words)
        while found < least and (more := next(lines, None)):
            end = more[1]
            found += len(data[slice(*more)].split())
        rows.append((first, end))
    return rows


def words_in(data: bytes, span: Span, *, comments: bool = False) -> list[bytes]:
    """The words of a row."""
    text = data[slice(*span)]
    lines = content_spans(text, 0, comments=comments)
    return [word for first, end in lines for word in text[first:end].split()]


def line_end_of(data: bytes, start: int) -> bytes:
    """How lines end in a text."""
    found = _LINE_END.search(data, max(start - 2, 0))
    return found[0] if found else b"\n"


def after_line(data: bytes, place: int) -> tuple[bytes, int]:
    """How the line that a byte is in ends, and where the next one begins.

    Header and rows of a file may end their lines differently. Faces follow, so there is an end.
    """
    found = _LINE_END.search(data, place)
    assert found is not None  # noqa: S101 - the file has been read
    return found[0], found.end()


def replaced(data: bytes, start: int, changes: dict[Span, bytes]) -> bytes:
    """Put other bytes in the place of some spans, in the order of the file."""
    pieces, reached = [data[:start]], start
    for first, end in sorted(changes):
        pieces += [data[reached:first], changes[first, end]]
        reached = end
    return b"".join([*pieces, data[reached:]])


def between(points: DividedFaces, values: Callable[[Ints], Floats]) -> tuple[Floats, Floats]:
    """Interpolate what a file has at vertices.

    Args:
        points: the new ones.
        values: gives the rows (k, c) of some vertices.

    Returns:
        (p, c) what lies there, and (p, 3, c) what it lies between.
    """
    used, numbers = np.unique(points.corners, return_inverse=True)
    table = values(np.asarray(used, dtype=np.int64))
    local = numbers.reshape(points.corners.shape)
    near = DividedFaces(points.faces, local, points.weights, points.exponent)
    return near.interpolated(table), table[local]


def directions(means: Floats, ends: Floats) -> Floats:
    """Unit vectors along means (p, 3) of normals; one of these, (p, 3), where they cancel out."""
    lengths = row_lengths(means)[:, None]
    with np.errstate(invalid="ignore"):
        cancelled = ~(lengths > _SHORTEST)
    return np.where(cancelled, ends, means / np.where(cancelled, 1.0, lengths))
