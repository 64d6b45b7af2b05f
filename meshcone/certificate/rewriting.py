"""Comparing a refined file with what writing the optimum into the source gives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from meshcone.assets import Asset
from meshcone.errors import InputError
from meshcone.pair import Pair
from meshcone.surface.arrays import Floats, row_lengths
from meshcone.written import WrittenVertices


@dataclass(frozen=True)
class Rewriting:
    """How a refined file compares. Lengths are relative to the reference's radius.

    Attributes:
        vertices: those that the refined file stores.
        offset: largest distance of one of its vertices, split at seams, from the same one
            of the source with the optimum written into it.
        precision: largest distance between the optimum and what the file format keeps of it.
        identical: whether the two files are the same bytes.
    """

    vertices: WrittenVertices
    offset: float
    precision: float
    identical: bool


def compare_with_rewritten(
    pair: Pair, answer: Floats, refined: bytes, optimum: Floats
) -> Rewriting:
    """Write an answer (n, 3) in the frame into the source, and compare a refined file.

    The optimum (n, 3) is the answer before what is pinned was put exactly there.

    Raises:
        InputError, LimitError: the refined file cannot be read, or is of another mesh.
    """
    rewritten = pair.patched(answer)
    expected, found = pair.read_patched(rewritten), pair.read_patched(refined)
    if not _same_structure(expected, found):
        raise InputError("the refined file has other vertices or faces than the source")
    kept = WrittenVertices.of(pair, expected).away_from(optimum)
    return Rewriting(
        vertices=WrittenVertices.of(pair, found),
        offset=_longest(found.positions - expected.positions) / pair.frame.radius,
        precision=float(kept.max(initial=0.0)),
        identical=refined == rewritten,
    )


def require_same_structure(pair: Pair, written: Asset) -> None:
    """Check that a file is the source with its vertices elsewhere.

    Raises:
        InputError: it has other vertices or faces.
    """
    if _same_structure(pair.source_asset, written):
        return
    if len(written.positions) == len(pair.source_asset.positions):
        # The triangles that a polygon is split into depend on where its corners are.
        again = pair.read_patched(pair.patched(WrittenVertices.of(pair, written).in_frame))
        if _same_structure(again, written):
            return
    raise InputError("the refined file has other vertices or faces than the source")


def _same_structure(one: Asset, other: Asset) -> bool:
    return len(one.positions) == len(other.positions) and bool(
        np.array_equal(one.triangles, other.triangles)
    )


def _longest(vectors: Floats) -> float:
    return float(row_lengths(vectors).max(initial=0.0))
