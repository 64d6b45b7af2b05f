"""Divisions of any mesh, for tests: sides split in their middle, in all faces that have them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from meshcone.surface import Subdivision

Corner = tuple[int, int, int]
EXPONENT = 6


def bisected(faces: NDArray[np.int64], picks: Sequence[int]) -> Subdivision:
    """Split one side for each pick, counted among those there are; all faces keep fitting."""
    whole = 2**EXPONENT
    children: list[tuple[int, list[Corner]]] = [
        (parent, [(whole, 0, 0), (0, whole, 0), (0, 0, whole)]) for parent in range(len(faces))
    ]
    for pick in picks:
        parent, corners = children[pick % len(children)]
        ends = {_place(faces, parent, corners[(pick + k) % 3]) for k in (0, 1)}
        split: list[tuple[int, list[Corner]]] = []
        for owner, (a, b, c) in children:
            turned = [(a, b, c), (b, c, a), (c, a, b)]
            found = [t for t in turned if {_place(faces, owner, each) for each in t[:2]} == ends]
            if not found or any((x + y) % 2 for x, y in zip(*found[0][:2], strict=True)):
                split.append((owner, [a, b, c]))
                continue
            one, other, tip = found[0]
            middle: Corner = tuple((x + y) // 2 for x, y in zip(one, other, strict=True))
            split += [(owner, [one, middle, tip]), (owner, [middle, other, tip])]
        children = split
    parents = np.array([parent for parent, _ in children])
    return Subdivision(len(faces), parents, np.array([each for _, each in children]), EXPONENT)


def _place(faces: NDArray[np.int64], parent: int, corner: Corner) -> object:
    """What a corner is, whichever face it is seen from."""
    weights = zip(faces[parent].tolist(), corner, strict=True)
    between = frozenset((vertex, weight) for vertex, weight in weights if weight)
    return (between, parent) if len(between) == 3 else between
