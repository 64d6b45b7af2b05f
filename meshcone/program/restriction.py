"""A program with some vertices free and all others held where they are.

What it takes of a round's program is what touches a free vertex: the pulls on it and on the faces
around it, and the fairness of it and of its neighbours. Of the cones it keeps those between free
vertices. One that also touches a held vertex may be out of reach of the free ones, and which of
them satisfy it is for the region to say in which all are free.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import sparse

from meshcone.program.cones import ConeFamily
from meshcone.program.multipliers import Multipliers
from meshcone.program.pulls import PlanePull, SurfacePoints
from meshcone.program.regions import neighbours
from meshcone.program.surface_objective import SurfaceObjective
from meshcone.program.vertex_blocks import VertexBlocks
from meshcone.surface.arrays import Bools, Floats, Ints


@dataclass(frozen=True)
class RestrictedObjective:
    """An objective as a function of the free vertices.

    Attributes:
        around: the objective over the free vertices and, after them, the held ones they feel.
        held: (h, 3) where the latter are.
    """

    around: SurfaceObjective
    held: Floats

    @cached_property
    def linear(self) -> Floats:
        """The vector c, (3f,)."""
        return (self.around.linear + self.around.apply(self._at_zero))[: self._size]

    @cached_property
    def constant(self) -> float:
        """The objective's value with every free vertex at the origin."""
        x = self._at_zero
        return float(0.5 * x @ self.around.apply(x) + self.around.linear @ x + self.around.constant)

    def apply(self, x: Floats) -> Floats:
        """Return P x for (3f,)."""
        return self.around.apply(self._padded(x))[: self._size]

    def diagonal_blocks(self) -> VertexBlocks:
        """Return the 3×3 blocks on the diagonal of P."""
        return VertexBlocks(self.around.diagonal_blocks().entries[: self._size // 3])

    def product(self) -> Callable[[Floats], Floats]:
        """Return x ↦ P x as a function worth its preparation when it is called dozens of times."""
        whole = self.around.product()
        return lambda x: whole(self._padded(x))[: self._size]

    def matrix(self) -> sparse.csc_array:
        """Return P, (3f, 3f)."""
        return sparse.csc_array(self.around.matrix()[: self._size, : self._size])

    @property
    def _size(self) -> int:
        return 3 * (len(self.around.previous) - len(self.held))

    @property
    def _at_zero(self) -> Floats:
        return np.concatenate([np.zeros(self._size), self.held.ravel()])

    def _padded(self, x: Floats) -> Floats:
        return np.concatenate([x, np.zeros(self.held.size)])


def restricted_objective(
    objective: SurfaceObjective, free: Ints, positions: Floats
) -> RestrictedObjective:
    """Restrict an objective of n vertices.

    Args:
        objective: over all vertices.
        free: (f,) the free ones, ascending.
        positions: (n, 3) where the others are held.
    """
    count = len(positions)
    is_free = np.zeros(count, dtype=bool)
    is_free[free] = True
    fairness = objective.fairness
    rows = neighbours(free, fairness.laplacian)  # L has the same pattern as its transpose
    smoothed = sparse.csr_array(fairness.laplacian[rows])
    touching = _touching(objective.carried, is_free)
    felt = np.zeros(count, dtype=bool)
    felt[smoothed.indices] = True
    if objective.carried is not None:
        felt[objective.carried.corners[touching]] = True
    held = np.flatnonzero(felt & ~is_free)
    kept = np.concatenate([free, held])
    number = np.full(count, -1, dtype=np.int64)
    number[kept] = np.arange(len(kept))
    entries = (smoothed.data, number[smoothed.indices].astype(np.int32), smoothed.indptr)
    around = SurfaceObjective(
        forward=_taken(objective.forward, kept),
        backward=None if objective.backward is None else _taken(objective.backward, touching),
        carried=_carried(objective.carried, touching, number, len(kept)),
        previous=objective.previous[kept],
        proximity=objective.proximity,
        fairness=replace(
            fairness,
            laplacian=sparse.csr_array(entries, shape=(len(rows), len(kept))),
            weights=fairness.weights[rows],
            outline=fairness.outline[rows],
            normals=fairness.normals[rows],
            rest=fairness.rest[rows],
        ),
    )
    return RestrictedObjective(around, positions[held])


@dataclass(frozen=True)
class RestrictedCones:
    """The cones of a family that only free vertices have a part in.

    Attributes:
        whole: the family.
        which: (j,) these cones in it, ascending.
        family: they alone, by the numbers of the free vertices.
    """

    whole: ConeFamily
    which: Ints
    family: ConeFamily

    @staticmethod
    def of(whole: ConeFamily, free: Ints, vertices: int) -> RestrictedCones:
        """Restrict a family over so many vertices to (f,) free ones."""
        number = np.full(vertices, -1, dtype=np.int64)
        number[free] = np.arange(len(free))
        renumbered = number[whole.vertices]
        which = np.flatnonzero((renumbered >= 0).all(axis=1))
        return RestrictedCones(whole, which, whole.chosen(which, renumbered[which]))

    def inward(self, multipliers: Sequence[Multipliers]) -> list[Multipliers]:
        """Take multipliers of the family to its restriction."""
        found: list[Multipliers] = []
        for entry in multipliers:
            if entry.family.kind == self.whole.kind:
                kept = np.isin(entry.which, self.which)
                places = np.searchsorted(self.which, entry.which[kept])
                found.append(Multipliers(self.family, places, entry.values[kept]))
        return found

    def outward(self, multipliers: Sequence[Multipliers], own: Bools) -> tuple[Ints, Floats]:
        """Take multipliers of the restriction to the family, of the cones of (n,) own vertices.

        A cone between own vertices and others belongs to the region that owns its first.

        Returns:
            (j,) the cones in the family and (j, dimension) their multipliers.
        """
        for entry in multipliers:
            if entry.family is self.family:
                which = self.which[entry.which]
                mine = own[self.whole.vertices[which, 0]]
                return which[mine], entry.values[mine]
        return np.empty(0, dtype=np.int64), np.empty((0, self.whole.dimension))


def _touching(carried: SurfacePoints | None, chosen: Bools) -> Ints:
    """List the points that a chosen vertex carries."""
    if carried is None:
        return np.empty(0, dtype=np.int64)
    return np.flatnonzero(chosen[carried.corners].any(axis=1)).astype(np.int64)


def _taken(pull: PlanePull, places: Ints) -> PlanePull:
    return replace(
        pull,
        weights=pull.weights[places],
        normals=pull.normals[places],
        targets=pull.targets[places],
    )


def _carried(
    carried: SurfacePoints | None, places: Ints, number: Ints, count: int
) -> SurfacePoints | None:
    if carried is None:
        return None
    return SurfacePoints(number[carried.corners[places]], carried.weights[places], count)
