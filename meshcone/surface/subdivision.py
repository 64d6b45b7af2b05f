"""How the faces of a mesh are divided into smaller ones, in whole numbers."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from meshcone.surface.arrays import Bools, Floats, Ints

# Twice the area of a parent is 4 ** exponent. Sums of areas are exact in float64 up to 2 ** 53.
MAX_EXPONENT = 26


@dataclass(frozen=True)
class DividedFaces:
    """The faces of a subdivision over the vertices of one table of the source.

    Attributes:
        faces: (f, 3) indices: below n a row of the source's table, n + i the new point i.
        corners: (k, 3) rows of the source's table that each new point lies between; a point of
            an edge has both ends, the smaller first, and repeats the second.
        weights: (k, 3) numerators of their weights; the repeated corner has 0.
        exponent: the weights' denominator is 2 ** exponent.
    """

    faces: Ints
    corners: Ints
    weights: Ints
    exponent: int

    def interpolated(self, values: Floats) -> Floats:
        """Interpolate (n, c) values of the source's table at the new points, (k, c).

        A point between two ends has the same value whichever face it is seen from.
        """
        shares = self.weights / 2.0**self.exponent
        terms = values[self.corners] * shares[:, :, None]
        return np.asarray((terms[:, 0] + terms[:, 1]) + terms[:, 2], dtype=np.float64)


@dataclass(frozen=True)
class Subdivision:
    """Faces of a source mesh divided into smaller faces that lie in them.

    A corner of a new face is ``corners / 2 ** exponent`` of the corners of its parent, in the
    parent's order: (2 ** exponent, 0, 0) is the parent's first corner. The order of a new face's
    corners is the order in which it runs around, the same as its parent's. A face that is not
    divided is its own only child. Children stand in the order of their parents.

    Diagonals between these children may then be swapped, those on sides of parents too: a face
    takes the corners that ``slots`` names, which may be those of children of other parents. It
    keeps its row, and with it its place, group and material in a file.

    Attributes:
        sources: number of faces of the source.
        parents: (f,) the face of the source that each child lies in, ascending.
        corners: (f, 3, 3) barycentric numerators: child, its corner, corner of the parent.
        exponent: all numerators are over 2 ** exponent; from 0 to ``MAX_EXPONENT``.
        slots: (f, 3) of each corner of each new face, 3 times the child that has it before
            diagonals are swapped, plus its number there. By default none is swapped.
    """

    sources: int
    parents: Ints
    corners: NDArray[np.int32]
    exponent: int
    slots: Ints = field(default_factory=lambda: np.empty((0, 3), dtype=np.int64))

    def __post_init__(self) -> None:
        object.__setattr__(self, "parents", np.ascontiguousarray(self.parents, dtype=np.int64))
        object.__setattr__(self, "corners", np.ascontiguousarray(self.corners, dtype=np.int32))
        slots = self.slots if len(self.slots) else self._own_slots()
        object.__setattr__(self, "slots", np.ascontiguousarray(slots, dtype=np.int64))

    def _own_slots(self) -> Ints:
        return np.arange(3 * len(self.parents), dtype=np.int64).reshape(-1, 3)

    @staticmethod
    def none(sources: int) -> Subdivision:
        """Return the subdivision that divides none of so many faces."""
        corners = np.tile(np.eye(3, dtype=np.int32), (sources, 1, 1))
        return Subdivision(sources, np.arange(sources, dtype=np.int64), corners, 0)

    @property
    def divided(self) -> Bools:
        """(sources,) which faces of the source have other children than themselves."""
        changed = np.asarray(np.bincount(self.parents, minlength=self.sources) != 1)
        changed[self.parents[self.swapped]] = True
        return changed

    @property
    def swapped(self) -> Bools:
        """(f,) which faces have other corners than the child in their row."""
        return np.asarray((self.slots != self._own_slots()).any(axis=1))

    @property
    def owners(self) -> Ints:
        """(f, 3) the face of the source that each corner of each new face is told in."""
        return self.parents[self.slots // 3]

    @property
    def places(self) -> NDArray[np.int32]:
        """(f, 3, 3) ``corners`` of the new faces, each in the face that ``owners`` names."""
        return np.asarray(self.corners.reshape(-1, 3)[self.slots])

    def unswapped(self) -> Subdivision:
        """Return the children as they tile their parents, with no diagonal swapped."""
        return Subdivision(self.sources, self.parents, self.corners, self.exponent)

    def renumbered(self, numbers: Ints, sources: int) -> Subdivision:
        """Take the children of some faces, which have other numbers somewhere else.

        Args:
            numbers: (sources,) number there of each face here, −1 for one that is not there.
            sources: how many faces there are; those that none here is are not divided.
        """
        mine = np.flatnonzero(numbers[self.parents] >= 0)
        others = np.setdiff1d(np.arange(sources), numbers)
        parents = np.concatenate([numbers[self.parents[mine]], others])
        own = np.tile(np.eye(3, dtype=np.int32) << self.exponent, (len(others), 1, 1))
        order = np.argsort(parents, kind="stable")
        rows = np.empty(len(order), dtype=np.int64)
        rows[order] = np.arange(len(order))
        row_of_child = np.full(len(self.parents), -1, dtype=np.int64)
        row_of_child[mine] = rows[: len(mine)]
        slots = 3 * rows[:, None] + np.arange(3)
        taken = self.slots[mine]
        slots[: len(mine)] = 3 * row_of_child[taken // 3] + taken % 3
        corners = np.concatenate([self.corners[mine], own])[order]
        return Subdivision(sources, parents[order], corners, self.exponent, slots[order])

    def mirrored(self) -> Subdivision:
        """Return the same for faces whose corners are listed the other way around."""
        slots = self.slots[:, ::-1]
        return Subdivision(
            self.sources,
            self.parents,
            self.corners[:, ::-1, ::-1],
            self.exponent,
            slots // 3 * 3 + (2 - slots % 3),
        )

    def is_tiling(self) -> bool:
        """Tell, by whole numbers alone, whether the children of every parent tile it.

        Corners must lie in their parent, children must run around as it does, and their areas
        must add up to its own. Every side of a child must be met by the opposite side of
        another child of the same parent, unless it lies on a side of the parent. The sides of
        all children are then a closed chain on the parent's border, so that each point inside
        is covered equally often, which is once by the areas. Nothing overlaps, nothing is
        left out, and no corner lies within the side of another child. Parents are looked at
        one by one; :meth:`is_conforming` says whether they agree on the sides they share.
        """
        if not self._is_sound():
            return False
        areas = _doubled_areas(self.corners[:, :, :2].astype(np.int64))
        if not (areas > 0).all():
            return False
        sums = np.bincount(self.parents, areas, self.sources)
        return bool((sums == 4.0**self.exponent).all()) and self._sides_meet()

    def is_conforming(self, faces: Ints) -> bool:
        """Tell whether faces of the source divide each side that they share at the same points.

        Args:
            faces: (sources, 3) corners of the source's faces; ``is_tiling`` must hold.
        """
        triples, weights = self._over(faces)
        on_edge = np.count_nonzero(weights, axis=2) == 2
        rows, _ = np.nonzero(on_edge)
        ids, shares = triples[on_edge], weights[on_edge]
        seen = _distinct(np.column_stack([ids[:, :2], shares[:, 0], self.parents[rows]]))
        count = max(int(faces.max(initial=0)) + 1, 1)
        following = np.roll(faces, -1, axis=1)
        sides = np.minimum(faces, following) * count + np.maximum(faces, following)
        edges, uses = np.unique(sides, return_counts=True)
        points, parents = np.unique(seen[:, :3], axis=0, return_counts=True)
        expected = uses[np.searchsorted(edges, points[:, 0] * count + points[:, 1])]
        return bool((parents == expected).all())

    def over(self, faces: Ints, count: int) -> DividedFaces:
        """Divide the source's faces over a table of vertices, texture coordinates or normals.

        New points on an edge are one wherever both ends are the same rows of the table: faces
        that share the edge share the point, and at a seam, where their rows differ, each side
        has its own. A point inside a face is its own. New points are in ascending order of
        (corners, weights, parent).

        Args:
            faces: (sources, 3) rows of the table at the corners of the source's faces.
            count: n, the rows that the table has.
        """
        corners, weights = self._over(faces)
        corners, weights = corners.reshape(-1, 3), weights.reshape(-1, 3)
        between = np.count_nonzero(weights, axis=1)
        inside = np.where(between == 3, np.repeat(self.parents, 3), -1)
        keys = np.column_stack([corners, weights, inside])
        new = between > 1
        points, numbers = _numbered(keys[new])
        divided = corners[:, 0].copy()
        divided[new] = count + numbers
        return DividedFaces(divided[self.slots], points[:, :3], points[:, 3:6], self.exponent)

    def _over(self, faces: Ints) -> tuple[Ints, Ints]:
        """Corners (f, 3, 3) of each new corner in a table, ascending and merged, and weights.

        Corners without weight repeat the last one that has some.
        """
        corners = np.repeat(faces[self.parents][:, None, :], 3, axis=1)
        weights = self.corners.astype(np.int64)
        order = np.argsort(np.where(weights > 0, corners, np.iinfo(np.int64).max), axis=2)
        corners = np.take_along_axis(corners, order, axis=2)
        weights = np.take_along_axis(weights, order, axis=2)
        for first, second in ((0, 1), (1, 2), (0, 1)):  # rows that are equal become one
            same = (corners[..., first] == corners[..., second]) & (weights[..., second] > 0)
            weights[..., first] += np.where(same, weights[..., second], 0)
            weights[..., second] = np.where(same, 0, weights[..., second])
            empty = weights[..., first] == 0
            for table in (corners, weights):
                swapped = table[empty]
                swapped[:, [first, second]] = swapped[:, [second, first]]
                table[empty] = swapped
        for place in (1, 2):
            none = weights[..., place] == 0
            corners[..., place] = np.where(none, corners[..., place - 1], corners[..., place])
        return corners, weights

    def _is_sound(self) -> bool:
        """Whether shapes, ranges and sums are what the attributes say."""
        rows = len(self.parents)
        if not 0 <= self.exponent <= MAX_EXPONENT or self.corners.shape != (rows, 3, 3):
            return False
        if rows and not (self.parents.min() >= 0 and self.parents.max() < self.sources):
            return False
        sums = self.corners.astype(np.int64).sum(axis=2)
        ordered = bool((np.diff(self.parents) >= 0).all())
        return ordered and bool((self.corners >= 0).all() and (sums == 2**self.exponent).all())

    def _sides_meet(self) -> bool:
        """Whether every side inside a parent is met by the opposite one."""
        first, second = self.corners, np.roll(self.corners, -1, axis=1)
        inside = ~((first == 0) & (second == 0)).any(axis=2)
        owner = np.broadcast_to(self.parents[:, None], inside.shape)[inside]
        ends = [
            np.column_stack([owner, table[inside][:, :2].astype(np.int64)])
            for table in (first, second)
        ]
        _, numbers = _numbered(np.concatenate(ends))
        start, end = np.split(numbers, 2)
        keys = np.minimum(start, end) * max(len(numbers), 1) + np.maximum(start, end)
        _, edge = np.unique(keys, return_inverse=True)
        balance = np.bincount(edge, np.where(start < end, 1, -1))
        return bool((balance == 0).all())


def _doubled_areas(points: Ints) -> Ints:
    """Twice the signed areas (f,) of triangles (f, 3, 2)."""
    one, other = points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]
    return np.asarray(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0])


def _numbered(rows: Ints) -> tuple[Ints, Ints]:
    """Return the distinct ones of (k, c) rows in lexicographic order, and each row's number."""
    order = np.lexsort(rows.T[::-1])
    ordered = rows[order]
    starts = np.ones(len(rows), dtype=bool)
    starts[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    numbers = np.empty(len(rows), dtype=np.int64)
    numbers[order] = np.cumsum(starts) - 1
    return ordered[starts], numbers


def _distinct(rows: Ints) -> Ints:
    return _numbered(rows)[0]
