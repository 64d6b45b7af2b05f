"""The pieces a search has cut a mesh into: a table that only grows."""

from __future__ import annotations

from typing import Any

import numpy as np

from meshcone.quality.deviation.leaves import MOST_FACES, WEIGHT_PARTS, Leaves
from meshcone.surface.arrays import Bools, Floats, Ints

_COLUMNS: dict[str, tuple[Any, tuple[int, ...]]] = {
    "corners": (np.int32, (3,)),
    "face": (np.int32, ()),
    "bound": (np.float64, ()),
    "depth": (np.int16, ()),
    "edge": (np.int8, ()),
    "at": (np.float64, ()),
    "cut": (np.bool_, ()),
    "bounding": (np.int32, (MOST_FACES,)),
    "weights": (np.int32, (MOST_FACES,)),
}


class Pieces:
    """Pieces by number: first the faces of the mesh, then the two halves of each cut.

    Attributes:
        corners: (n, 3) points.
        face: (n,) the face of the mesh each is a part of.
        bound: (n,) no point of the piece is farther from the other surface, but for rounding.
        depth: (n,) cuts above it.
        edge, at: (n,) where it is to be cut; −1 while that is not known.
        cut: (n,) whether it has been.
        bounding, weights: (n, 4) what proves its bound; faces beyond the last have no weight.
    """

    corners: Ints
    face: Ints
    bound: Floats
    depth: Ints
    edge: Ints
    at: Floats
    cut: Bools
    bounding: Ints
    weights: Ints

    def __init__(self, faces: Ints) -> None:
        """Begin with the faces of a mesh, (m, 3), which have no bound yet."""
        self.faces = self.count = 0
        self._cuts: list[Ints] = []
        for name, (kind, shape) in _COLUMNS.items():
            setattr(self, name, np.zeros((len(faces), *shape), dtype=kind))
        every = np.arange(len(faces))
        self._append(faces, every, np.zeros_like(every), np.full(len(faces), np.inf))
        self.faces = len(faces)

    def note(self, rows: Ints, bound: Floats, faces: Ints, weights: Ints | None = None) -> None:
        """Take bounds for pieces where they are better than what is known.

        Args:
            rows: (k,) pieces.
            bound: (k,).
            faces: (f, k) what bounds them.
            weights: (f, k) in parts; none where one face bounds each piece.
        """
        better = np.flatnonzero(bound < self.bound[rows])
        rows = rows[better]
        self.bound[rows] = bound[better]
        self.bounding[rows, : len(faces)] = faces[:, better].T
        self.weights[rows] = 0
        parts = WEIGHT_PARTS if weights is None else weights[:, better].T
        self.weights[rows, : len(faces)] = parts

    def split(self, rows: Ints, points: Ints) -> Ints:
        """Cut pieces at (k,) points on their edges; the numbers of the halves, (2k,).

        Until it has a better one, a half has the bound of the whole.
        """
        order, edge = np.arange(len(rows)), self.edge[rows].astype(np.int64)
        a, b, c = (self.corners[rows][order, (edge + turn) % 3] for turn in range(3))
        corners = np.stack([np.stack([a, points, c], 1), np.stack([points, b, c], 1)], 1)
        twice = np.repeat(rows, 2)
        self.cut[rows] = True
        self._cuts.append(rows)
        halves = self._append(
            corners.reshape(-1, 3), self.face[twice], self.depth[twice] + 1, self.bound[twice]
        )
        self.bounding[halves], self.weights[halves] = self.bounding[twice], self.weights[twice]
        return halves

    def _append(self, corners: Ints, face: Ints, depth: Ints, bound: Floats) -> Ints:
        rows = np.arange(self.count, self.count + len(corners))
        self.count += len(corners)
        room = len(self.face)
        if room < self.count:
            for name in _COLUMNS:
                old = getattr(self, name)
                grown = np.zeros((max(2 * room, self.count), *old.shape[1:]), dtype=old.dtype)
                grown[:room] = old
                setattr(self, name, grown)
        self.corners[rows], self.face[rows] = corners, face
        self.depth[rows], self.bound[rows], self.edge[rows] = depth, bound, -1
        return rows

    def largest_bound(self) -> float:
        """The largest bound of all pieces that are not cut."""
        return float(self.bound[: self.count][~self.cut[: self.count]].max())

    def leaves(self) -> Leaves:
        """Write down what was cut and what bounds the rest, pieces numbered by generation."""
        cut = np.concatenate(self._cuts) if self._cuts else np.empty(0, dtype=np.int64)
        number, order = self._by_generation(cut)
        leaf = np.flatnonzero(~self.cut[: self.count])
        leaf = leaf[np.argsort(number[leaf])]
        weights = self.weights[leaf]
        used = weights > 0
        return Leaves(
            cut=number[cut[order]],
            edge=self.edge[cut[order]].astype(np.int64),
            at=self.at[cut[order]],
            count=used.sum(axis=1),
            faces=self.bounding[leaf][used].astype(np.int64),
            weights=weights[used].astype(np.int64),
        )

    def _by_generation(self, cut: Ints) -> tuple[Ints, Ints]:
        """New numbers of all pieces, and the order of cuts by the new number of what is cut."""
        number = np.arange(self.count)
        order = np.empty(0, dtype=np.int64)
        depth = self.depth[cut]
        for generation in range(int(depth.max(initial=-1)) + 1):
            these = np.flatnonzero(depth == generation)
            these = these[np.argsort(number[cut[these]])]
            halves = self.faces + 2 * (len(order) + np.arange(len(these)))
            was = self.faces + 2 * these
            number[was], number[was + 1] = halves, halves + 1
            order = np.concatenate([order, these])
        return number, order
