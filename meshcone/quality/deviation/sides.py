"""How far a mesh goes outside and inside of a closed reference, each as an interval."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from meshcone.quality.deviation.area import all_beyond
from meshcone.quality.deviation.interval import Asked
from meshcone.quality.deviation.placing import MOST_CUTS_DEEP
from meshcone.quality.deviation.search import Search, blocks
from meshcone.surface.arrays import Bools, Floats, Ints

OUTSIDE, INSIDE = 1, -1
# Pieces worked on at a time, those with the largest bounds first.
_BATCH = 8192
# Points asked for at first, which are doubled until both sides have one.
_FIRST_LOOK = 256

# Which of (k, 3) points the reference encloses, (k,).
Encloses = Callable[[Floats], Bools]


@dataclass(frozen=True)
class Side:
    """The largest distance on one side, in the meshes' unit.

    Attributes:
        lower, upper: it lies between. A piece belongs to one side alone where it does not meet the
            reference, which counts on the closest points found, and to both elsewhere.
        position: (3,) a point ``lower`` away on that side; None where there is none.
        answered: whether the interval is as narrow as asked for.
    """

    lower: float
    upper: float
    position: Floats | None
    answered: bool


def deviation_by_side(
    search: Search, encloses: Encloses, asked: Asked, is_apart: Callable[[], bool] = lambda: False
) -> tuple[Side, Side]:
    """Tell apart how far a mesh goes outside and inside of its reference.

    Args:
        search: of the mesh against a closed reference, after its own run.
        encloses: in the meshes' unit.
        asked: when to stop; bars are not looked at.
        is_apart: whether no face of the mesh passes through the reference, so that each is on one
            side as a whole; asked for where no point was met on one of the sides.

    Returns:
        Outside and inside.
    """
    sides = _Sides(search, encloses, asked)
    if sides.may_be_one and is_apart():
        sides.take_whole_faces()
    sides.run()
    return sides.answer(OUTSIDE), sides.answer(INSIDE)


class _Sides:
    """The pieces of a search, with the side each is on: 0 where that is not known."""

    def __init__(self, search: Search, encloses: Encloses, asked: Asked) -> None:
        self._search, self._encloses, self._asked = search, encloses, asked
        self._side = np.zeros(search.pieces.count, dtype=np.int64)
        self._looked_at = np.zeros(search.pieces.count, dtype=bool)
        self._met = {OUTSIDE: 0.0, INSIDE: 0.0}
        self._at: dict[int, Floats] = {}
        self._meet_farthest(*search.known_points())

    @property
    def may_be_one(self) -> bool:
        """Whether no point was met on one of the sides."""
        return min(self._met.values()) == 0

    def take_whole_faces(self) -> None:
        """Tell the side of every face by its middle."""
        placed, pieces = self._search.placed, self._search.pieces
        middles = placed.mesh.corners.mean(axis=1)
        enclosed = self._encloses(middles * placed.unit + placed.origin)
        side = np.where(enclosed, INSIDE, OUTSIDE)
        self._side = side[pieces.face[: pieces.count]]

    def answer(self, side: int) -> Side:
        """What was found of a side."""
        placed, pieces = self._search.placed, self._search.pieces
        here = ~pieces.cut[: pieces.count] & (self._side * side >= 0)
        bounds = pieces.bound[: pieces.count][here]
        upper = float(bounds.max(initial=0.0))
        upper = (upper + placed.rounding) * placed.unit if upper > 0 else 0.0
        at = self._at.get(side)
        lower = 0.0 if at is None else self._search.distance_at_least(at)
        return Side(
            lower=lower,
            upper=upper,
            position=None if at is None else at * placed.unit + placed.origin,
            answered=upper - lower <= max(self._asked.width, self._asked.share * upper),
        )

    def run(self) -> None:
        """Tell sides and cut pieces until both intervals are narrow, or the pieces run out."""
        pieces = self._search.pieces
        while len(rows := self._needed()):
            fresh = rows[~self._looked_at[rows]]
            for block in blocks(fresh):
                self._look_at(block)
            if len(fresh):
                continue
            rows = rows[pieces.depth[rows] < MOST_CUTS_DEEP]
            if not len(rows) or pieces.count - pieces.faces >= self._asked.most_pieces:
                return
            self._side = np.concatenate([self._side, np.repeat(self._side[rows], 2)])
            self._looked_at = np.concatenate([self._looked_at, np.zeros(2 * len(rows), bool)])
            self._search.split(rows)

    def _look_at(self, rows: Ints) -> None:
        """Find the side of pieces that do not meet the reference."""
        found = self._search.evaluate(rows, lambda: -1.0, creases=False)
        self._looked_at[rows] = True
        apart = all_beyond(found, self._search.placed.rounding)
        # Of the others only those can matter that are farther than what a side has.
        telling = apart | (found.centre_distances > min(self._met.values()))
        centres = found.corners[telling].mean(axis=1)
        side = self._meet(centres, found.centre_distances[telling])
        self._side[found.rows[apart]] = side[apart[telling]]

    def _meet_farthest(self, points: Floats, distances: Floats) -> None:
        """Take points (k, 3) into account, the farthest first, until each side has one."""
        order = np.argsort(-distances, kind="stable")
        start, step = 0, _FIRST_LOOK
        while start < len(order) and min(self._met.values()) == 0:
            rows = order[start : start + step]
            self._meet(points[rows], distances[rows])
            start, step = start + step, 2 * step

    def _meet(self, points: Floats, distances: Floats) -> Ints:
        """Take points (k, 3) into account; the side of each, (k,)."""
        placed = self._search.placed
        enclosed = self._encloses(points * placed.unit + placed.origin)
        side = np.where(enclosed, INSIDE, OUTSIDE)
        for each in (OUTSIDE, INSIDE):
            here = np.flatnonzero(side == each)
            worst = here[distances[here].argmax()] if len(here) else None
            if worst is not None and distances[worst] > self._met[each]:
                self._met[each], self._at[each] = float(distances[worst]), points[worst]
        return side

    def _needed(self) -> Ints:
        """The pieces that keep an interval wide, at most a batch."""
        pieces, unit = self._search.pieces, self._search.placed.unit
        bound = pieces.bound[: pieces.count]
        needed = np.zeros(pieces.count, dtype=bool)
        for side, met in self._met.items():
            bar = self._asked.narrow(met * unit) / unit - 2 * self._search.placed.rounding
            needed |= (self._side * side >= 0) & (bound > bar)
        rows = np.flatnonzero(needed & ~pieces.cut[: pieces.count])
        return rows[np.argsort(-bound[rows], kind="stable")[:_BATCH]]
