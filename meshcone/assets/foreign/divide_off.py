"""Divides the faces of an OFF file, with all that its vertices and faces carry."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from meshcone.assets.foreign.divide import (
    ForeignTriangles,
    Span,
    after_line,
    between,
    content_spans,
    directions,
    replaced,
    row_spans,
    words_in,
)
from meshcone.assets.foreign.off import KEYWORD
from meshcone.assets.number_style import NumberStyle
from meshcone.errors import InputError
from meshcone.surface.arrays import Floats, Ints
from meshcone.surface.subdivision import Subdivision

_COUNTS = re.compile(rb"[+]?(\d+)(\s+)[+]?(\d+)(\s+\d+)?")
_WHOLE = re.compile(rb"[+-]?\d+")


def divided_off(data: bytes, triangles: ForeignTriangles, subdivision: Subdivision) -> bytes:
    """Write a file with faces divided, and every vertex where it was.

    New vertices follow those there are; colours, normals and texture coordinates after the
    place are interpolated. What follows the corners of a face follows those of each of its
    parts. A number of edges becomes 0, which stands for none that was counted.

    Raises:
        InputError: what a vertex carries is no number, or one has more of it than another.
    """
    lines = content_spans(data, 0, comments=True)
    vertices, faces, keyword, counts = _counts(data, lines)
    normals = bool(keyword[3])
    first = 6 if normals else 3
    rows = row_spans(lines, data, vertices, lambda _: first)
    polygons = triangles.divided(subdivision, vertices)
    values, ends = between(polygons.over, lambda some: _numbers(data, rows, some))
    if normals:
        values[:, 3:6] = directions(values[:, 3:6], ends[:, 0, 3:6])
    line_end, after = after_line(data, rows[-1][1])
    changes: dict[Span, bytes] = {}
    shades = range(first, values.shape[1] - (2 if keyword[1] else 0))
    changes[after, after] = _written(data, rows, values, line_end, shades)
    added = 0
    spans = row_spans(lines, data, faces, lambda size: int(size) + 1)
    for row, children in polygons.groups():
        size, *words = words_in(data, spans[row], comments=True)
        rest = words[int(size) :]
        written = polygons.over.faces[children].tolist()
        parts = [b" ".join([b"3 %d %d %d" % tuple(each), *rest]) for each in written]
        changes[spans[row]] = line_end.join(parts)
        added += len(parts) - 1
    found = _COUNTS.match(data[slice(*counts)])
    assert found is not None  # noqa: S101 - the file has been read
    edges = re.sub(rb"\d+", b"0", found[4] or b"")
    counted = b"%d%s%d%s" % (vertices + len(values), found[2], faces + added, edges)
    changes[counts[0], counts[0] + found.end()] = counted
    return replaced(data, 0, changes)


def carries_more(data: bytes) -> bool:
    """Whether some face carries more than its corners."""
    lines = content_spans(data, 0, comments=True)
    vertices, faces, keyword, _ = _counts(data, lines)
    row_spans(lines, data, vertices, lambda _: 6 if keyword[3] else 3)
    spans = row_spans(lines, data, faces, lambda size: int(size) + 1)
    rows = (words_in(data, span, comments=True) for span in spans)
    return any(len(words) > int(words[0]) + 1 for words in rows)


def _counts(data: bytes, lines: Iterator[Span]) -> tuple[int, int, re.Match[bytes], Span]:
    """Vertices, faces, the keyword, and where the counts are."""
    start, end = next(lines)
    keyword = KEYWORD.match(data[start:end])
    assert keyword is not None  # noqa: S101 - the file has been read
    counts = start + keyword.end(), end
    if counts[0] == counts[1]:
        counts = next(lines)
    vertices, faces = map(int, data[slice(*counts)].split(None, 3)[:2])
    return vertices, faces, keyword, counts


def _numbers(data: bytes, rows: list[Span], some: Ints) -> Floats:
    """What some vertices carry, (k, c)."""
    words = [words_in(data, rows[row], comments=True) for row in some.tolist()]
    if len({len(each) for each in words}) > 1:
        raise InputError("of two vertices beside a new one, one carries more numbers")
    try:
        return np.array([[float(word) for word in each] for each in words])
    except ValueError:
        raise InputError("a vertex beside a new one carries something else than numbers") from None


def _written(
    data: bytes, rows: list[Span], values: Floats, line_end: bytes, shades: range
) -> bytes:
    """Lines of new vertices; whole numbers of shades, which are some columns, stay whole."""
    if not len(values):
        return b""
    sample = [words_in(data, row, comments=True) for row in rows[:: max(1, len(rows) // 20_000)]]
    place = NumberStyle.of(word for words in sample for word in words[:3]).resolving(values[:, :3])
    columns = values.shape[1]
    # A shade of 0 or 1 is none or all of it where none is larger: what lies between is neither.
    are_bytes = bool((np.abs(values[:, shades.start : shades.stop]) > 1).any()) or any(
        len(w) > 1 for words in sample for w in words[shades.start : shades.stop]
    )
    whole = [
        k in shades
        and are_bytes
        and all(_WHOLE.fullmatch(w) for words in sample for w in words[k : k + 1])
        for k in range(columns)
    ]
    formats = [
        place.format if column < 3 else (b"%.0f" if whole[column] else b"%.9g")
        for column in range(columns)
    ]
    lines = (b" ".join(f % v for f, v in zip(formats, row, strict=True)) for row in values.tolist())
    return b"".join(line + line_end for line in lines)
