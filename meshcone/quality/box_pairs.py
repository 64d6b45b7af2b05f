"""Pairs of boxes that overlap, by a tree of boxes descended against itself.

What :func:`_descend` calls stands above it, because it is compiled when it is read, and in this
file, because numba compiles a function again when that file has changed and no other.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from meshcone.surface.arrays import Bools, Floats, Ints
from meshcone.surface.box_tree import BoxTree
from meshcone.surface.compiled import compiled

_PAIRS_AT_ONCE = 1 << 16
# Of nodes and boxes; on meshes about two, however large.
_TESTS_PER_PAIR = 25
# Pairs of nodes that wait: three for each step down, and a tree is halved at most 63 times.
_DEEPEST = 512

_ROWS = "float64[:,::1]"


class TooManyPairsError(Exception):
    """There are more pairs than the caller allows, or finding them takes as long."""


def overlapping_pairs(
    tree: BoxTree, most: int, *, within: float = 0.0, among: Bools | None = None
) -> Iterator[tuple[Ints, Ints]]:
    """Find all pairs of faces whose closed boxes have a point in common, each once, in blocks.

    Args:
        tree: of the faces, whose positions are finite.
        most: pairs there may be. It bounds the time, and unlike a clock it ends the search
            at the same place on every machine.
        within: boxes that are no farther apart than this along each axis count as well.
        among: (m,) which faces to look at; by default all.

    Yields:
        Indices (k,) of the first and of the second faces, the smaller one first.

    Raises:
        TooManyPairsError: ``most`` were not enough.
    """
    count = len(tree.faces)
    if count < 2:
        return
    kept = np.ones(count, dtype=np.bool_) if among is None else among.take(tree.order)
    own, boxes = np.empty((count, 6)), np.empty_like(tree.boxes)
    _fit(tree.corners, kept, tree.spans, tree.children, own, boxes)
    waiting, found = np.zeros((_DEEPEST, 2), dtype=np.int64), 0
    # How many pairs of nodes wait, and how many tests are left.
    progress = np.array([1, _TESTS_PER_PAIR * max(most, count)], dtype=np.int64)
    while progress[0]:
        pairs = np.empty((_PAIRS_AT_ONCE, 2), dtype=np.int64)
        nodes = tree.order, tree.spans, tree.children, boxes
        block = pairs[: _descend(*nodes, own, within, waiting, progress, pairs)]
        found += len(block)
        if found > most or progress[1] < 0:
            raise TooManyPairsError
        yield block[:, 0], block[:, 1]


@compiled(f"void({_ROWS}, boolean[::1], int64[:,::1], int64[::1], {_ROWS}, {_ROWS})")
def _fit(
    corners: Floats, kept: Bools, spans: Ints, children: Ints, own: Floats, boxes: Floats
) -> None:
    """Write the boxes of faces and of nodes; what is not to be looked at has an empty one."""
    for place in range(len(corners)):
        for k in range(3):
            a, b, c = corners[place, k], corners[place, 3 + k], corners[place, 6 + k]
            own[place, k] = min(a, min(b, c)) if kept[place] else np.inf
            own[place, 3 + k] = max(a, max(b, c)) if kept[place] else -np.inf
    for node in range(len(children) - 1, -1, -1):
        inner, begin, end = boxes, children[node], children[node] + 2
        if children[node] < 0:
            inner, begin, end = own, spans[node, 0], spans[node, 1]
        for k in range(3):
            low, high = np.inf, -np.inf
            for part in range(begin, end):
                low, high = min(low, inner[part, k]), max(high, inner[part, 3 + k])
            boxes[node, k], boxes[node, 3 + k] = low, high


@compiled()
def _near(boxes: Floats, i: int, j: int, within: float) -> bool:
    for k in range(3):
        if boxes[i, k] - boxes[j, 3 + k] > within or boxes[j, k] - boxes[i, 3 + k] > within:
            return False
    return True


@compiled(
    f"int64(int64[::1], int64[:,::1], int64[::1], {_ROWS}, {_ROWS}, float64,"
    "int64[:,::1], int64[::1], int64[:,::1])"
)
def _descend(
    order: Ints,
    spans: Ints,
    children: Ints,
    boxes: Floats,
    own: Floats,
    within: float,
    waiting: Ints,
    progress: Ints,
    pairs: Ints,
) -> int:
    """Go on with the pairs of nodes that wait until ``pairs`` is nearly full; count them."""
    found, top, tests_left = 0, progress[0], progress[1]
    while top > 0 and tests_left >= 0:
        first, second = waiting[top - 1, 0], waiting[top - 1, 1]
        if children[first] < 0 and children[second] < 0:
            begin, end = spans[first, 0], spans[first, 1]
            other, last = spans[second, 0], spans[second, 1]
            if found + (end - begin) * (last - other) > len(pairs):
                break
            top -= 1
            for i in range(begin, end):
                for j in range(i + 1 if first == second else other, last):
                    tests_left -= 1
                    if _near(own, i, j, within):
                        pairs[found, 0] = min(order[i], order[j])
                        pairs[found, 1] = max(order[i], order[j])
                        found += 1
            continue
        top -= 1
        if first == second:
            left = children[first]
            waiting[top, 0], waiting[top, 1] = left, left
            waiting[top + 1, 0], waiting[top + 1, 1] = left + 1, left + 1
            top += 2
            tests_left -= 1
            if _near(boxes, left, left + 1, within):
                waiting[top, 0], waiting[top, 1] = left, left + 1
                top += 1
            continue
        # The node of more faces is halved.
        size = spans[first, 1] - spans[first, 0]
        if children[first] < 0 or (
            children[second] >= 0 and spans[second, 1] - spans[second, 0] > size
        ):
            first, second = second, first
        for child in range(children[first], children[first] + 2):
            tests_left -= 1
            if _near(boxes, child, second, within):
                waiting[top, 0], waiting[top, 1] = child, second
                top += 1
    progress[0], progress[1] = top, tests_left
    return found
