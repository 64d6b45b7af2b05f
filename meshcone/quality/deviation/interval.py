"""How far any point of one surface lies from the other: an interval that is proven."""

from __future__ import annotations

from dataclasses import dataclass, field

from meshcone.quality.deviation.leaves import Leaves
from meshcone.quality.deviation.points import Hints
from meshcone.quality.deviation.search import Farthest, Level, Search
from meshcone.surface import Mesh

_ROUNDING = 1e-12
# Pieces that are made at most once all bars are decided: a fifth of a second.
_AFTERWARDS = 20_000


@dataclass(frozen=True)
class Asked:
    """When to stop.

    Attributes:
        width: how wide the interval may stay, in the meshes' unit.
        share: the same as a share of its upper end; the larger of both counts.
        most_pieces: how many pieces may be made beyond the faces of the mesh.
        bars: values to be told from the distance. Where there are some, nothing else is
            asked for: little is cut any more once each is known to be exceeded or not.
    """

    width: float
    share: float
    most_pieces: int
    bars: tuple[float, ...] = ()

    @property
    def level(self) -> Level:
        """What a piece may be bounded by and still need no more work."""
        return self._undecided if self.bars else self.narrow

    def _undecided(self, met: float) -> float:
        left = min((bar for bar in self.bars if bar >= met), default=float("inf"))
        return left * (1 - _ROUNDING)  # whoever compares may have rounded bar and bound

    def narrow(self, met: float) -> float:
        """What a piece may be bounded by in an interval as narrow as asked for."""
        return max(met + self.width, met / (1 - self.share))

    def answered_by(self, lower: float, upper: float) -> bool:
        """Whether an interval is as narrow as asked for, or decides all bars."""
        if self.bars:
            return all(upper <= bar or lower > bar for bar in self.bars)
        return upper - lower <= max(self.width, self.share * upper)


@dataclass(frozen=True)
class Interval:
    """How far any point of a mesh lies from its reference.

    Both ends are proven, whatever the search did.

    Attributes:
        lower, upper: the largest distance lies between, in the meshes' unit.
        farthest: a point that is ``lower`` away, at least.
        answered: whether this is what was asked for; else the pieces ran out.
        leaves: what proves ``upper``, for
            :func:`~meshcone.quality.deviation.check.check_leaves`.
        pieces: how many were made beyond the faces of the mesh.
    """

    lower: float
    upper: float
    farthest: Farthest
    answered: bool
    leaves: Leaves = field(repr=False)
    pieces: int


def searched_deviation(
    mesh: Mesh, reference: Mesh, asked: Asked, hints: Hints | None = None
) -> tuple[Interval, Search]:
    """Do as :func:`directed_deviation`, and return the search as well, to go on with."""
    search = Search(mesh, reference, hints)
    search.run(asked.level, asked.most_pieces)
    if asked.bars:
        made = search.pieces.count - search.pieces.faces
        # A little more, so that the interval is of use to those who want to know how far it is.
        search.run(asked.narrow, min(asked.most_pieces, made + _AFTERWARDS))
    farthest = search.farthest()
    lower, upper = farthest.distance, search.upper
    interval = Interval(
        lower=lower,
        upper=upper,
        farthest=farthest,
        answered=asked.answered_by(lower, upper),
        leaves=search.pieces.leaves(),
        pieces=search.pieces.count - search.pieces.faces,
    )
    return interval, search


def directed_deviation(
    mesh: Mesh, reference: Mesh, asked: Asked, hints: Hints | None = None
) -> Interval:
    """Bound the largest distance of any point of ``mesh`` from ``reference``.

    This is the one-sided Hausdorff distance. The bounds hold for every point of every
    triangle, not for samples; meshes may be any triangles, closed or not, in any order.

    Args:
        mesh: whose points are asked about.
        reference: in the same unit.
        asked: when to stop.
        hints: what is known of the two already.

    Raises:
        InputError: a mesh has no faces or a position that is not finite.
    """
    return searched_deviation(mesh, reference, asked, hints)[0]
