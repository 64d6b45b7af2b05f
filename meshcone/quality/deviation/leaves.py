"""How the pieces of a surface were bounded, as a record that needs no search to be checked."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from meshcone.errors import InputError
from meshcone.quality.deviation.placing import MOST_CUTS_DEEP
from meshcone.surface.arrays import Floats, Ints

# A leaf's weights are whole numbers of this part; they add up to 1 without rounding.
WEIGHT_PARTS = 1 << 24
MOST_FACES = 4

# The arrays of a record, with the types they are stored as.
_STORED: dict[str, type] = {
    "cut": np.int32,
    "edge": np.int8,
    "at": np.float64,
    "count": np.int8,
    "faces": np.int32,
    "weights": np.int32,
}


@dataclass(frozen=True)
class Leaves:
    """The cuts that divide a mesh's faces into pieces, and what bounds each piece.

    Pieces are numbered: first the m faces of the mesh, then the two halves of each cut, in
    the order of the cuts. A cut parts a piece (a, b, c) on the edge from its corner ``edge`` to the
    next one; with that edge turned to the front, at x = a + t (b − a), its halves are
    (a, x, c) and (x, b, c), which tile it whatever t between 0 and 1 is. A piece that is not
    cut is a leaf.

    Up to four faces T_k of the reference R bound a leaf with corners p_i, mixed by weights
    μ_k ≥ 0 that add up to 1. For every point x = Σ λ_i p_i of it

        d(x, R) ≤ Σ_k μ_k d(x, T_k) ≤ Σ_i λ_i Σ_k μ_k d(p_i, T_k) ≤ max_i Σ_k μ_k d(p_i, T_k),

    because T_k belongs to R and the distance to a convex set is convex.

    Attributes:
        cut: (c,) the pieces that are cut, ascending: generation after generation.
        edge: (c,) on which of its three edges.
        at: (c,) where on that edge, between 0 and 1.
        count: (l,) how many faces bound each leaf, leaves in the order of their numbers.
        faces: (sum of count,) those faces.
        weights: (sum of count,) their weights, in parts of 2⁻²⁴.
    """

    cut: Ints
    edge: Ints
    at: Floats
    count: Ints
    faces: Ints
    weights: Ints

    def arrays(self) -> dict[str, Any]:
        """Return the record as compact arrays, to be stored."""
        return {name: getattr(self, name).astype(kind) for name, kind in _STORED.items()}

    @staticmethod
    def of_arrays(arrays: Mapping[str, Any]) -> Leaves:
        """Take a record from stored arrays.

        Raises:
            InputError: an array is missing, not of the type it is stored as, or not as long as
                others it belongs to. Nothing is copied to a larger type before that is known.
        """
        for name, kind in _STORED.items():
            array = arrays.get(name)
            if array is None or array.ndim != 1 or array.dtype.kind not in "iuf":
                raise InputError(f"the record of leaves has no usable array '{name}'")
            if kind is not np.float64 and array.dtype.kind == "f":
                raise InputError(f"the record of leaves has numbers that are not whole: '{name}'")
            stored = np.dtype(kind)
            if (array.dtype.kind, array.dtype.itemsize) != (stored.kind, stored.itemsize):
                raise InputError(f"the record of leaves has an array of another type: '{name}'")
        length = {name: len(arrays[name]) for name in _STORED}
        _require_whole(length["cut"], length["edge"], length["at"])
        if not length["cut"] < length["count"] <= length["faces"] <= MOST_FACES * length["count"]:
            raise InputError("the leaves do not tile the mesh: a piece has no bound")
        if length["faces"] != length["weights"]:
            raise InputError("the record of leaves has bounds that are not whole")
        return Leaves(
            **{
                name: arrays[name].astype(np.float64 if kind is np.float64 else np.int64)
                for name, kind in _STORED.items()
            }
        )

    def require_sound(self, faces: int, reference_faces: int) -> None:
        """Check everything about the record that can be checked without positions.

        Args:
            faces: of the mesh that is divided.
            reference_faces: of the mesh that bounds it.

        Raises:
            InputError: the leaves do not tile the mesh, or a leaf has no bound.
        """
        cuts = len(self.cut)
        _require_whole(cuts, len(self.edge), len(self.at))
        if cuts and not (
            (self.cut >= 0).all()  # first of all: the difference of others may wrap around
            and (self.cut < faces + 2 * np.arange(cuts)).all()
            and (np.diff(self.cut) > 0).all()
            and ((self.edge >= 0) & (self.edge <= 2)).all()
            and ((self.at >= 0) & (self.at <= 1)).all()
        ):
            raise InputError("the leaves do not tile the mesh: a cut is not of a piece there is")
        if len(self.count) != faces + cuts or not np.isin(self.count, range(1, 5)).all():
            raise InputError("the leaves do not tile the mesh: a piece has no bound")
        total = int(self.count.sum())
        if not len(self.faces) == len(self.weights) == total:
            raise InputError("the record of leaves has bounds that are not whole")
        if ((self.faces < 0) | (self.faces >= reference_faces)).any():
            raise InputError("a leaf is bounded by a face that the reference does not have")
        if ((self.weights < 0) | (self.weights > WEIGHT_PARTS)).any():
            raise InputError("a leaf has a weight that is not between 0 and 1")
        first = np.cumsum(self.count) - self.count
        if (np.add.reduceat(self.weights, first) != WEIGHT_PARTS).any():
            raise InputError("a leaf has weights that do not add up to 1")

    def pieces(self, corners: Floats) -> Iterator[tuple[Floats, Ints, bool]]:
        """Divide the mesh as recorded, a generation at a time.

        Args:
            corners: (m, 3, 3) of its faces.

        Yields:
            (k, 3, 3) corners of leaves, (k,) the places of these in ``count``, and whether
            they are whole faces.

        Raises:
            InputError: there are more generations of cuts than the bound on rounding covers.
        """
        start, done, leaves = 0, 0, 0
        generations = 0
        while len(corners):
            upto = int(np.searchsorted(self.cut, start + len(corners)))
            now = slice(done, upto)
            parted = self.cut[now] - start
            whole = np.ones(len(corners), dtype=bool)
            whole[parted] = False
            count = int(whole.sum())
            yield corners[whole], np.arange(leaves, leaves + count), generations == 0
            leaves += count
            start += len(corners)
            corners = halves(corners[parted], self.edge[now], self.at[now])
            done = upto
            generations += 1
            if len(corners) and generations > MOST_CUTS_DEEP:
                raise InputError(f"a piece is cut more than {MOST_CUTS_DEEP} times")


def _require_whole(cuts: int, edges: int, places: int) -> None:
    if not edges == places == cuts:
        raise InputError("the record of leaves has cuts that are not whole")


def halves(corners: Floats, edge: Ints, at: Floats) -> Floats:
    """Cut (k, 3, 3) pieces on an edge each; the halves of one follow each other, (2k, 3, 3)."""
    rows = np.arange(len(corners))
    a, b, c = (corners[rows, (edge + turn) % 3] for turn in range(3))
    x = a + at[:, None] * (b - a)
    parts = np.stack([np.stack([a, x, c], axis=1), np.stack([x, b, c], axis=1)], axis=1)
    return parts.reshape(-1, 3, 3)
