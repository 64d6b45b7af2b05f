"""Reads an OFF file whose lines say nothing: its numbers one after the other.

Geomview's own reader passes over line ends, so that the counts, vertices and faces of some files
are divided into lines as it happens.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import islice

import numpy as np

from meshcone.assets.foreign.polygons import Polygons, check_corners, check_positions
from meshcone.assets.foreign.text import Line, decimal, integer
from meshcone.assets.limits import Limits
from meshcone.errors import InputError

_WORD = re.compile(rb"\S+")


def read_words(lines: Iterator[Line], numbers: int, limits: Limits) -> Polygons | None:
    """Read what follows the keyword; None unless its words are exactly those of its counts.

    Args:
        lines: the text after the keyword, with the numbers of its lines.
        numbers: how many a vertex has.
        limits: caps on sizes.

    Raises:
        LimitError: it declares more than ``limits`` accept.
    """
    words = ((number, word[0]) for number, text in lines for word in _WORD.finditer(text))
    try:
        return _read(words, numbers, limits)
    except InputError:
        return None


def _read(words: Iterator[Line], numbers: int, limits: Limits) -> Polygons | None:
    counts = [integer(word, line, "a count") for line, word in islice(words, 3)]
    if len(counts) < 3 or min(counts) < 0:
        return None
    vertices, faces, _ = counts
    limits.check("vertices", vertices, "vertices")
    limits.check("faces", faces, "faces")
    stated = islice(words, vertices * numbers)
    values = np.fromiter((decimal(word, line) for line, word in stated), dtype=np.float64)
    if len(values) < vertices * numbers:
        return None
    sizes: list[int] = []
    corners: list[int] = []
    for line, word in islice(words, faces):
        size = integer(word, line, "a number of corners")
        limits.check("faces", len(corners) - 2 * len(sizes) + size - 2, "triangles")
        found = [integer(each, line, "a vertex") for line, each in islice(words, max(size, 0))]
        if len(found) != size:
            return None
        sizes.append(size)
        corners += found
    if len(sizes) < faces or next(words, None) is not None:
        return None
    polygons = Polygons(
        values.reshape(-1, numbers)[:, :3].copy(),
        np.array(corners, dtype=np.int64),
        np.array(sizes, dtype=np.int64),
    )
    check_corners(polygons.corners, polygons.sizes, vertices, lambda _: "")
    check_positions(polygons.positions, lambda _: "")
    return polygons
