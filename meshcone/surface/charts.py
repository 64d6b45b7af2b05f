"""Which faces of a file hang together in every respect, and how its texture coordinates lie."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from meshcone.surface.arrays import Bools, Floats, Ints
from meshcone.surface.subdivision import Subdivision

_ROUNDING = 2.0**-48  # of a coordinate: what interpolation and a difference can be off


@dataclass(frozen=True)
class Charts:
    """What joins the faces of a file, beyond the place of their corners.

    Two faces are in one chart where they share a side, both ends of which are one vertex to the
    file in every respect: texture coordinates, normal, colour and all else.

    Attributes:
        corners: (m, 3) number of the file's vertex at each corner.
        labels: (m,) faces of one label may exchange surface: they have one material, group and
            place in the file. Negative for a face that has to keep its sides.
        planes: (m, 3, 2) texture coordinates at each corner, for each set that there is; NaN
            where a face has none.
    """

    corners: Ints
    labels: Ints
    planes: tuple[Floats, ...] = ()

    @staticmethod
    def alone(corners: Ints) -> Charts:
        """Join all faces that share vertices; there are no texture coordinates."""
        return Charts(corners, np.zeros(len(corners), dtype=np.int64))

    def keeping(self, kept: Bools) -> Charts:
        """Let some faces (m,) keep their sides."""
        return Charts(self.corners, np.where(kept, -1, self.labels), self.planes)

    def over(self, subdivision: Subdivision) -> ChartedFaces:
        """Follow the charts onto the children of a subdivision, before diagonals are swapped."""
        base = subdivision.unswapped()
        count = int(self.corners.max(initial=-1)) + 1
        weights = base.corners / 2.0**base.exponent
        turns = np.empty((base.sources, len(self.planes)), dtype=np.int64)
        known = np.ones(base.sources, dtype=bool)
        for number, plane in enumerate(self.planes):
            turns[:, number] = turning(plane)
            known &= (turns[:, number] != 0) | np.isnan(plane).all(axis=(1, 2))
        keys = np.concatenate([self.labels[:, None], turns], axis=1)
        _, groups = np.unique(keys, axis=0, return_inverse=True)
        groups = np.where((self.labels >= 0) & known, groups.ravel(), -1)
        return ChartedFaces(
            base.over(self.corners, count).faces,
            np.asarray(groups[base.parents], dtype=np.int64),
            tuple(np.einsum("fcp,fpk->fck", weights, each[base.parents]) for each in self.planes),
            turns[base.parents],
        )


@dataclass(frozen=True)
class ChartedFaces:
    """The children of a subdivision, as charts know them.

    Attributes:
        corners: (f, 3) number of the file's vertex at each corner, new ones among them.
        groups: (f,) children of one group may exchange surface; negative: keeps its sides.
        planes: (f, 3, 2) texture coordinates at each corner.
        turns: (f, p) 1 or -1 as a child runs around in each plane, 0 for one that does not.
    """

    corners: Ints
    groups: Ints
    planes: tuple[Floats, ...]
    turns: Ints

    def retiled(self, slots: Ints) -> str | None:
        """Tell what is wrong with children whose diagonals are swapped; None if nothing is.

        They must stay within their group, run around in every plane as their group does, and
        use every vertex. Together the sides of a group must be those that it had, but for
        pairs that cancel out, so that its border is the same chain. A point of the plane that
        no side meets is then covered by as many triangles as before: the border's winding
        number around it, which does not depend on what is inside.

        Args:
            slots: of the children, as :class:`Subdivision` has them, each in range.
        """
        moved = (slots != np.arange(slots.size).reshape(-1, 3)).any(axis=1)
        groups = self.groups[slots // 3]
        if (groups[moved] < 0).any() or (groups != groups[:, :1])[moved].any():
            return "a face has corners of another chart or material, or of a face that stays"
        if (groups[:, 0] != self.groups)[moved].any():
            return "a face has taken the row of another chart or material"
        for plane, turns in zip(self.planes, self.turns.T, strict=True):
            if (turning(plane.reshape(-1, 2)[slots[moved]]) != turns[moved]).any():
                return "a triangle of texture coordinates is turned over, or without area"
        now = self.corners.ravel()[slots]
        if len(np.unique(self.corners)) != len(np.unique(now)):
            return "a vertex is in no face any more"
        if (now == np.roll(now, 1, axis=1))[moved].any():
            return "a face has a corner twice"
        balance = _chain(now, self.groups, 1), _chain(self.corners, self.groups, -1)
        keys, counts = (np.concatenate(each) for each in zip(*balance, strict=True))
        _, numbers = np.unique(keys, axis=0, return_inverse=True)
        if np.bincount(numbers.ravel(), counts).any():
            return "the border of a chart is another one"
        return None


def turning(points: Floats) -> Ints:
    """1 or -1 as triangles (f, 3, 2) of the plane run around, 0 where rounding may decide it.

    The bound on rounding is a safe one for coordinates that were interpolated once.
    """
    one, other = points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]
    areas = one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
    sizes = np.maximum(np.abs(one), np.abs(other)).max(axis=1, initial=0.0)
    largest = np.abs(points).max(axis=(1, 2), initial=0.0)
    sure = np.abs(areas) > 8 * _ROUNDING * sizes * largest
    return np.where(sure, np.sign(np.nan_to_num(areas)), 0.0).astype(np.int64)


def _chain(faces: Ints, groups: Ints, sign: int) -> tuple[Ints, Ints]:
    """The sides of faces, as (3f, 3) group and ends, the smaller first, and (3f,) their sense."""
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    low, high = np.minimum(start, end), np.maximum(start, end)
    keys = np.stack([np.repeat(groups, 3), low, high], axis=1)
    return keys, sign * np.where(start < end, 1, -1)
