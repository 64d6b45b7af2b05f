"""Which defects of the mesh itself an answer has more of than its input, and where."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from meshcone.quality.intersections import count_self_intersections, self_intersections
from meshcone.quality.pieces import Pieces
from meshcone.surface import Mesh
from meshcone.surface.arrays import Bools, Floats, Ints

if TYPE_CHECKING:
    from meshcone.quality.harm import Examined

# Defects of the mesh itself may grow by this many, of a small mesh by fewer, or by this share
# of its faces; by more only where the mean distance falls to a quarter.
_FEWEST_DEFECTS, _FEW_SHARE = 4, 0.05
_DEFECT_SHARE, _SHARE_IF_MUCH_CLOSER, _MUCH_CLOSER = 0.005, 0.05, 0.25


@dataclass(frozen=True)
class Defect:
    """What there is more of than is allowed.

    Attributes:
        clause: in words.
        there: (m,) the faces among which that is.
    """

    clause: str
    there: Bools


class DefectCheck:
    """A source, prepared to be held against answers for defects of the mesh itself.

    Args:
        source: in the reference's frame.
        reference: in its own frame.
        samples: (k, 3) of the reference, by area.
        most_pairs: pairs of faces that may be tested for self-intersections.
    """

    def __init__(self, source: Mesh, reference: Mesh, samples: Floats, most_pairs: int) -> None:
        self._source, self._reference = source, reference
        self._samples, self._most_pairs = samples, most_pairs

    def found(self, was: Examined, now: Examined) -> list[Defect]:
        """List what there is more of than is allowed.

        Args:
            was: the source.
            now: the same faces elsewhere.
        """
        faces = len(self._source.faces)
        much_closer = now.distances.mean <= _MUCH_CLOSER * was.distances.mean
        share = _SHARE_IF_MUCH_CLOSER if much_closer else _DEFECT_SHARE
        few = min(_FEWEST_DEFECTS, int(_FEW_SHARE * faces))
        allowed = max(few, int(share * faces))
        found = [*self._turned(was, now, allowed), *self._crossed(was, now, allowed)]
        torn = _growth(was, now, lambda examined: examined.cracks, allowed)
        if torn > allowed:
            clause = f"{torn:,} more edges of open borders lie along another border"
            found.append(Defect(clause, self._everywhere))
        if now.shrunken.any():
            count = np.count_nonzero(now.shrunken)
            clause = f"{count:,} faces are of pieces that lose most of their area"
            found.append(Defect(clause, now.shrunken))
        return found

    def amiss(self, was: Examined, now: Examined, there: Bools) -> Bools:
        """Find the faces that are amiss now and were not, (m,), and have to do with (m,) there."""
        found = (there & now.opposed_faces & ~was.opposed_faces) | now.shrunken
        before, after = (self._pairs_of(mesh) for mesh in (was.mesh, now.mesh))
        if before is None or after is None:
            return np.asarray(found)
        count = len(self._source.faces)
        known = before[:, 0] * count + before[:, 1]
        new = ~np.isin(after[:, 0] * count + after[:, 1], known)
        found[after[new & there[after].any(axis=1)].ravel()] = True
        return np.asarray(found)

    def shrunken(self, mesh: Mesh) -> Bools:
        """Find the faces of connected pieces that have fallen to a fraction of their area, (m,)."""
        found = self._pieces.shrunken(self._source, mesh, self._reference, self._samples)
        return found[self._pieces.labels]

    def _turned(self, was: Examined, now: Examined, allowed: int) -> list[Defect]:
        words = "faces turn their backs on the reference"
        more = _growth(was, now, lambda examined: examined.opposed, allowed)
        if more > allowed:
            return [Defect(f"{more:,} more {words}", self._everywhere)]
        return self._at_pieces(
            was, now, lambda examined: np.flatnonzero(examined.opposed_faces), words
        )

    def _crossed(self, was: Examined, now: Examined, allowed: int) -> list[Defect]:
        words = "pairs of faces pass through each other"
        more = _growth(was, now, lambda examined: examined.crossing, allowed)
        found = (
            [Defect(f"{more:,} more {words}", self._everywhere)]
            if more > allowed
            else self._at_pieces(was, now, lambda examined: self._pairs_of(examined.mesh), words)
        )
        # Where the reference's own faces pass through each other, so will those that follow it.
        return found if found and (now.crossing or 0) > self._crossing_of_reference else []

    def _at_pieces(
        self, was: Examined, now: Examined, entries: Callable[[Examined], Ints | None], words: str
    ) -> list[Defect]:
        """Say where connected pieces have more than is allowed of them, be it little of them all.

        Args:
            was: the source.
            now: the same faces elsewhere.
            entries: the faces that count, or the pairs of them.
            words: what they are.
        """
        pieces, after = self._pieces, entries(now)
        if len(pieces.sizes) < 2 or after is None or (pieces.beyond_allowed(after) <= 0).all():
            return []
        before = entries(was)
        if before is None:
            return []
        known = pieces.counts(before)
        beyond_allowed = pieces.beyond_allowed(after) - known
        if (beyond_allowed <= 0).all():
            return []
        worst = int(np.argmax(beyond_allowed))
        more, size = pieces.counts(after)[worst] - known[worst], pieces.sizes[worst]
        clause = f"{more:,} more {words} at a piece of {size:,} faces"
        return [Defect(clause, (beyond_allowed > 0)[pieces.labels])]

    def _pairs_of(self, mesh: Mesh) -> Ints | None:
        return self_intersections(mesh, self._most_pairs)

    @property
    def _everywhere(self) -> Bools:
        return np.ones(len(self._source.faces), dtype=bool)

    @cached_property
    def _pieces(self) -> Pieces:
        return Pieces.of(self._source)

    @cached_property
    def _crossing_of_reference(self) -> int:
        return count_self_intersections(self._reference, self._most_pairs) or 0


_Count = Callable[["Examined"], int | None]


def _growth(was: Examined, now: Examined, count: _Count, allowed: int) -> int:
    """How many more there are than there were, which need not be looked at for a few."""
    after = count(now)
    if after is None or after <= allowed:
        return 0
    before = count(was)
    return 0 if before is None else after - before
