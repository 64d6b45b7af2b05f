"""Pairs of boxes that overlap, by a tree of boxes descended against itself.

libigl's tree answers for points and rays only, so this is one of numpy's own kind: the boxes
are sorted along a space-filling curve, each level of the tree halves the one below, and whole
blocks of pairs of nodes are tested at once.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from meshcone.surface.arrays import Floats, Ints
from meshcone.surface.ordering import spatial_order

_PAIRS_AT_ONCE = 1 << 18
# Of nodes; on meshes about ten, however large.
_TESTS_PER_PAIR = 25


class TooManyPairsError(Exception):
    """There are more pairs than the caller allows, or finding them takes as long."""


def overlapping_pairs(low: Floats, high: Floats, most: int) -> Iterator[tuple[Ints, Ints]]:
    """Find all pairs of closed boxes with a point in common, each pair once, in blocks.

    Args:
        low: (m, 3) smallest corners, finite.
        high: (m, 3) largest corners, finite.
        most: pairs there may be. It bounds the time, and unlike a clock it ends the search
            at the same place on every machine.

    Yields:
        Indices (k,) of the first and of the second boxes.

    Raises:
        TooManyPairsError: ``most`` were not enough.
    """
    if len(low) < 2:
        return
    order = spatial_order((low + high) / 2)
    levels = _levels(low[order], high[order])
    root = np.zeros(1, dtype=np.int64)
    found, tests, waiting = 0, 0, [(0, root, root)]
    while waiting:
        level, first, second = waiting.pop()
        if level == len(levels) - 1:
            apart = first != second
            found += int(apart.sum())
            if found > most:
                raise TooManyPairsError
            yield order[first[apart]], order[second[apart]]
            continue
        children = _children(first, second)
        tests += len(children[0])
        if tests > _TESTS_PER_PAIR * most:
            raise TooManyPairsError
        left, right = _overlapping(levels[level + 1], *children)
        for begin in range(0, len(left), _PAIRS_AT_ONCE):
            part = slice(begin, begin + _PAIRS_AT_ONCE)
            waiting.append((level + 1, left[part], right[part]))


def _levels(low: Floats, high: Floats) -> list[tuple[Floats, Floats]]:
    """Boxes (3, nodes) of each level, from the root's down to the leaves."""
    missing = (1 << (len(low) - 1).bit_length()) - len(low)
    # Boxes that overlap nothing fill the last level up to a power of two.
    low = np.concatenate([low, np.full((missing, 3), np.inf)])
    high = np.concatenate([high, np.full((missing, 3), -np.inf)])
    low, high = np.ascontiguousarray(low.T), np.ascontiguousarray(high.T)
    levels = [(low, high)]
    while low.shape[1] > 1:
        low = np.minimum(low[:, ::2], low[:, 1::2])
        high = np.maximum(high[:, ::2], high[:, 1::2])
        levels.append((low, high))
    return levels[::-1]


def _children(first: Ints, second: Ints) -> tuple[Ints, Ints]:
    """Pairs of children to test for each pair of nodes, a node with itself among them."""
    left = np.concatenate([2 * first, 2 * first, 2 * first + 1, 2 * first + 1])
    right = np.concatenate([2 * second, 2 * second + 1, 2 * second, 2 * second + 1])
    once = left <= right  # of a node with itself, its children come as a pair in both orders
    return left[once], right[once]


def _overlapping(boxes: tuple[Floats, Floats], first: Ints, second: Ints) -> tuple[Ints, Ints]:
    for low, high in zip(*boxes, strict=True):  # most pairs are told apart by one axis
        near = low.take(first) <= high.take(second)
        near &= low.take(second) <= high.take(first)
        first, second = first[near], second[near]
    return first, second
