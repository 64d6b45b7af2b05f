"""Which share of a surface lies farther from another than a tolerance: an interval."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from meshcone.quality.deviation.games import EDGES
from meshcone.quality.deviation.placing import MOST_CUTS_DEEP
from meshcone.quality.deviation.points import Hints
from meshcone.quality.deviation.search import Search, Unsettled, blocks
from meshcone.surface import Mesh
from meshcone.surface.arrays import Bools, Floats, Ints, row_lengths

# Pieces cut at a time, the largest first.
_BATCH = 8192
# Rounding of sums of areas, and of radii compared with lengths.
_ROUNDING = 1e-12


@dataclass(frozen=True)
class AreaShare:
    """Share of a surface's area farther than a tolerance from the other.

    Attributes:
        lower: area of pieces of which every point is farther. It counts on the closest points
            that the tree of boxes finds; all else here does not.
        upper: 1 minus the area of pieces that are proven to be within.
        decided: whether the interval is as narrow as asked, or tells the share from the bars.
    """

    lower: float
    upper: float
    decided: bool


def area_beyond(
    mesh: Mesh,
    reference: Mesh,
    tolerance: float,
    bars: tuple[float, ...],
    width: float,
    most_pieces: int,
    hints: Hints | None = None,
    uncertain: float = 0.0,
) -> AreaShare:
    """Bound the share of a mesh's area that lies farther than a tolerance from its reference.

    Args:
        mesh: whose area is asked about.
        reference: in the same unit.
        tolerance: in that unit.
        bars: shares that the answer is to be told from.
        width: how wide the interval may stay where no bar is inside.
        most_pieces: how many may be made beyond the faces of the mesh.
        hints: what is known of the two already.
        uncertain: how far the meshes may lie from the surfaces that are meant: what is within or
            beyond the tolerance has to be so by as much.

    Raises:
        InputError: a mesh has no faces or a position that is not finite.
    """
    search = _AreaSearch(Search(mesh, reference, hints), tolerance, uncertain)

    def decided() -> bool:
        return share_decided(*search.share, bars, width)

    search.run(decided, most_pieces)
    lower, upper = search.share
    return AreaShare(lower, upper, decided())


def share_decided(lower: float, upper: float, bars: tuple[float, ...], width: float) -> bool:
    """Whether a share is known as narrowly as asked, or told from the bars."""
    told = bool(bars) and all(upper <= bar or lower > bar for bar in bars)
    return upper - lower <= width or told


class _AreaSearch:
    """Parts a mesh into what is within, what is beyond, and what is open."""

    def __init__(self, search: Search, tolerance: float, uncertain: float) -> None:
        placed = search.placed
        self._search = search
        self._within = (tolerance - uncertain) / placed.unit - placed.rounding
        self._outside = (tolerance + uncertain) / placed.unit + placed.rounding
        areas = _areas(placed.mesh.corners)
        self._total = float(areas.sum())
        self._beyond = 0.0
        self._open, self._areas = np.arange(len(areas)), areas

    @property
    def share(self) -> tuple[float, float]:
        """The two ends."""
        if not self._beyond and not len(self._open):
            return 0.0, 0.0
        if not self._total > 0:
            return 0.0, 1.0
        lower = self._beyond / self._total
        upper = lower + float(self._areas.sum()) / self._total
        return max(lower - _ROUNDING, 0.0), min(upper + _ROUNDING, 1.0)

    def run(self, decided: Callable[[], bool], most_pieces: int) -> None:
        """Cut pieces until it is decided, or as many are made as may be."""
        pieces = self._search.pieces
        self._search.look_up(self._open, lambda: self._within)
        self._settle(self._take(np.ones(len(self._open), dtype=bool)))
        while len(self._open) and not decided():
            chosen = pieces.depth[self._open] < MOST_CUTS_DEEP
            if len(self._open) > _BATCH:
                chosen &= self._areas >= np.partition(self._areas, -_BATCH)[-_BATCH]
            if not chosen.any() or pieces.count - pieces.faces >= most_pieces:
                return
            self._settle(self._search.split(self._take(chosen)))

    def _take(self, chosen: Bools) -> Ints:
        """Take chosen pieces out of those that are open."""
        rows = self._open[chosen]
        self._open, self._areas = self._open[~chosen], self._areas[~chosen]
        return rows

    def _settle(self, rows: Ints) -> None:
        """Tell of pieces what is within and what is beyond, and leave the others open."""
        for block in blocks(rows):
            found = self._search.evaluate(block, lambda: self._within, creases=False)
            areas, beyond = _areas(found.corners), all_beyond(found, self._outside)
            self._beyond += float(areas[beyond].sum())
            self._open = np.concatenate([self._open, found.rows[~beyond]])
            self._areas = np.concatenate([self._areas, areas[~beyond]])


def _areas(corners: Floats) -> Floats:
    sides = corners[:, 1:] - corners[:, :1]
    return row_lengths(np.cross(sides[:, 0], sides[:, 1])) / 2


def all_beyond(found: Unsettled, tolerance: float) -> Bools:
    """Which pieces have no point within the tolerance of the other surface.

    The open balls about the corners and the centroid whose radii are the distances there hold
    no point of the other surface. In the plane of the piece, let discs about the same points
    have radii ρ = √(d² − tolerance²). If they cover the piece, and the discs of either end each
    edge, the balls hold all that is within the tolerance of the piece: a point y that close has its
    nearest point x of the piece inside, or on an edge to which y − x is perpendicular, or at a
    corner, and |y − p|² = |x − p|² + |y − x|² ≤ ρ² + tolerance² for the disc p that x is in.
    """
    distances, centre_distances = found.distances, found.centre_distances
    radii = np.sqrt(np.maximum(distances**2 - tolerance**2, 0))
    centre_radii = np.sqrt(np.maximum(centre_distances**2 - tolerance**2, 0)) * (1 - _ROUNDING)
    beyond: Bools = (distances.min(axis=1) > tolerance) & (centre_distances > tolerance)
    centres = found.corners.mean(axis=1)
    for i, j in EDGES:
        side = found.corners[:, j] - found.corners[:, i]
        both = radii[:, i] + radii[:, j]
        share = np.divide(radii[:, i], both, out=np.full(len(both), 0.5), where=both > 0)
        meeting = found.corners[:, i] + share[:, None] * side
        beyond &= row_lengths(side) < both * (1 - _ROUNDING)
        beyond &= row_lengths(meeting - centres) < centre_radii
    return beyond
