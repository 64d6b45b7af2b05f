"""Divides the facets of an STL file."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from meshcone.assets.foreign.divide import (
    DividedPolygons,
    ForeignTriangles,
    Span,
    content_spans,
    line_end_of,
    replaced,
)
from meshcone.assets.foreign.places import statements
from meshcone.assets.foreign.stl import HEADER, TRIANGLE, is_binary_stl
from meshcone.assets.number_style import NumberStyle
from meshcone.surface.arrays import Floats
from meshcone.surface.subdivision import Subdivision

_WORD = re.compile(rb"\S+")


def divided_stl(
    data: bytes, triangles: ForeignTriangles, subdivision: Subdivision, positions: Floats
) -> bytes:
    """Write a file with facets divided: each part has the normal and attributes of its facet.

    Args:
        data: the file.
        triangles: its facets.
        subdivision: of the faces of the surface.
        positions: (3k, 3) corners of all facets.
    """
    polygons = triangles.divided(subdivision, len(positions))
    points = polygons.over.interpolated(positions)
    if is_binary_stl(data):
        return _binary(data, polygons, np.concatenate([positions, points]))
    return _text(data, polygons, points, len(positions))


def has_attributes(data: bytes) -> bool:
    """Whether facets of a binary file differ in what their last two bytes say."""
    if not is_binary_stl(data):
        return False
    attributes = np.frombuffer(data, TRIANGLE, offset=HEADER)["attribute"]
    return bool((attributes != attributes[0]).any())


def _binary(data: bytes, polygons: DividedPolygons, positions: Floats) -> bytes:
    table = np.frombuffer(data, TRIANGLE, offset=HEADER)
    whole = np.delete(np.arange(len(table)), np.unique(polygons.rows))
    parts = table[polygons.rows].copy()
    parts["corners"] = positions[polygons.over.faces].astype("<f4")
    order = np.argsort(np.concatenate([whole, polygons.rows]), kind="stable")
    both = np.concatenate([table[whole], parts])[order]
    count = np.array(len(both), dtype="<u4").tobytes()
    return data[: HEADER - 4] + count + both.tobytes()


@dataclass(frozen=True)
class _Facet:
    """A facet of a text: where it is, and the words of its three corners."""

    span: Span
    words: list[Span]


def _text(data: bytes, polygons: DividedPolygons, points: Floats, count: int) -> bytes:
    facets = list(_facets(data))
    words = (
        data[slice(*word)] for facet in facets[:: max(1, count // 20_000)] for word in facet.words
    )
    style = NumberStyle.of(words)
    number = (style.resolving(points) if len(points) else style).format
    line_end = line_end_of(data, facets[0].span[0])
    changes: dict[Span, bytes] = {}
    for row, children in polygons.groups():
        facet = facets[row]
        start, end = facet.span
        before = data[max(data.rfind(b"\n", 0, start), data.rfind(b"\r", 0, start)) + 1 : start]
        indent = b"" if before.strip() else before  # a statement may stand before it in its line
        parts = []
        for corners in polygons.over.faces[children].tolist():
            pieces, reached = [], start
            for place, corner in enumerate(corners):
                for axis, (first, last) in enumerate(facet.words[3 * place : 3 * place + 3]):
                    if corner < count:
                        word = facets[corner // 3].words[3 * (corner % 3) + axis]
                        new = data[slice(*word)]
                    else:
                        new = number % (points[corner - count, axis] + 0.0)
                    pieces += [data[reached:first], new]
                    reached = last
            parts.append(b"".join([*pieces, data[reached:end]]))
        changes[start, end] = (line_end + indent).join(parts)
    return replaced(data, 0, changes)


def _facets(data: bytes) -> Iterator[_Facet]:
    start, words = 0, list[Span]()
    for line in content_spans(data, 0, comments=True):
        for span in statements(data[slice(*line)]):
            first = line[0] + span[0]
            found = [
                (first + w.start(), first + w.end())
                for w in _WORD.finditer(data[first : line[0] + span[1]])
            ]
            keyword = data[slice(*found[0])].lower()
            if keyword == b"facet":
                start, words = found[0][0], []
            elif keyword == b"vertex":
                words += found[1:4]
            elif keyword == b"endfacet":
                yield _Facet((start, found[0][1]), words)
