"""Comparing a refined file with what writing the optimum into the source gives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from meshcone.assets import Asset
from meshcone.errors import InputError
from meshcone.pair import Pair
from meshcone.surface.arrays import Floats, row_lengths


@dataclass(frozen=True)
class Rewriting:
    """How a refined file compares. Lengths are relative to the reference's radius.

    Attributes:
        positions: (n, 3) what the refined file stores, in the frame.
        offset: largest distance of one of its vertices, split at seams, from the same one
            of the source with the optimum written into it.
        precision: largest distance between the optimum and what the file format keeps of it.
        identical: whether the two files are the same bytes.
    """

    positions: Floats
    offset: float
    precision: float
    identical: bool


def compare_with_rewritten(pair: Pair, answer: Floats, refined: bytes) -> Rewriting:
    """Write an answer (n, 3) in the frame into the source, and compare a refined file.

    Raises:
        InputError, LimitError: the refined file cannot be read, or is of another mesh.
    """
    rewritten = pair.patched(answer)
    expected, found = pair.read_patched(rewritten), pair.read_patched(refined)
    if not _same_structure(expected, found):
        raise InputError("the refined file has other vertices or faces than the source")
    kept = pair.written_positions(expected) - answer
    return Rewriting(
        positions=pair.written_positions(found),
        offset=_longest(found.positions - expected.positions) / pair.frame.radius,
        precision=_longest(kept),
        identical=refined == rewritten,
    )


def _same_structure(one: Asset, other: Asset) -> bool:
    return (
        len(one.positions) == len(other.positions)
        and len(one.faces) == len(other.faces)
        and bool(np.array_equal(_raw_faces(one), _raw_faces(other)))
    )


def _raw_faces(asset: Asset) -> Floats:
    """Name each corner by the first vertex of the file that is welded into it, (m, 3)."""
    first = np.full(len(asset.vertices), len(asset.weld))
    used = np.flatnonzero(asset.weld >= 0)
    np.minimum.at(first, asset.weld[used], used)
    return first[asset.faces]


def _longest(vectors: Floats) -> float:
    return float(row_lengths(vectors).max(initial=0.0))
