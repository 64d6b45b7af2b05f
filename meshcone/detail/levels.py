"""Divides a source level by level where it misses its reference."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import ceil, log

import numpy as np

from meshcone.deadline import require_time
from meshcone.detail.chart_flips import Swapped, flip_in_charts
from meshcone.detail.choosing import choose_edges
from meshcone.detail.divided_mesh import DividedMesh, edge_of_sides
from meshcone.detail.flips import flip_inside
from meshcone.detail.misses import Misses, Target
from meshcone.detail.records import Stopped
from meshcone.options import Options
from meshcone.options.cones import ConeOptions
from meshcone.program.prepared_reference import PreparedReference
from meshcone.program.rounds import refine_surface
from meshcone.program.source_structure import SourceStructure
from meshcone.quality.intersections import self_intersections
from meshcone.surface import Mesh, Subdivision
from meshcone.surface.arrays import Bools, Floats, Ints
from meshcone.surface.charts import Charts
from meshcone.surface.subdivision import MAX_EXPONENT

# Faces after a level over those before, at most: the next level is to see what this one did.
_GROWTH = 1.6
# Faces that a level may add however few there are: one of a few split sides adds a face or two.
_FEWEST_ADDED = 4
_ROUNDS = (3.0, 1.0)  # fairness of the rounds of a level
# So much of the budget counts as all of it, and what a side inside a mesh cannot be split for.
_FULL, _LEAST_ADDED = 0.995, 2
# A level that takes less than this share off the squared distance does not help.
_LEAST_HELP = 1e-3
_ROUNDING = 1e-6  # of the radius: nearer than this, numbers in files say nothing
# Faces that would pass through others are left whole, and the level is tried again.
_RETRIES = 2
# Pairs of faces that pass through each other may become more by so many, or by this share.
_FEW_CROSSINGS, _CROSSING_SHARE = 4, 0.005


@dataclass(frozen=True)
class Detail:
    """Faces of a source, divided, and what became of its distance meanwhile.

    Attributes:
        subdivision: of the source's faces.
        levels: how often faces were chosen and split.
        stopped: why no further: the ``tolerance`` is met, the ``budget`` of faces is spent, or
            the last level did not help (``stagnation``), which is then left out.
        corners: (f, 3, 3) where the levels left the corners of each new face, in the frame.
    """

    subdivision: Subdivision
    levels: int
    stopped: Stopped
    corners: Floats


def find_detail(
    source: Mesh,
    reference: Mesh,
    divisible: Bools,
    options: Options,
    on_level: Callable[[int, int], None] | None = None,
    counts: Ints | None = None,
    charts: Charts | None = None,
) -> Detail:
    """Divide a source where it misses its reference.

    Each level scores the faces, splits edges of the worst, moves all vertices by the first
    rounds of the engine, and swaps diagonals inside faces of the source. The positions it
    reaches serve to choose the next edges; the division is what is returned.

    Args:
        source: in the reference's frame, with the vertices joined that are to move as one.
        reference: in its own frame.
        divisible: (m,) which faces of the source may be divided.
        options: ``detail``, and what the engine reads of the rest.
        on_level: called with the faces so far and the faces allowed.
        counts: (m,) how many faces each face stands for, itself among them; 0 for one that
            another stands for, which may not be divided. By default 1 for all.
        charts: of the source's faces, in which diagonals on their sides may be swapped; only
            where the options ask for it.

    Raises:
        SolveTimeoutError: the time that is allowed for solving is over.
    """
    alone = np.ones(len(source.faces), dtype=np.int64)
    levels = _Levels(source, reference, divisible, alone if counts is None else counts, options)
    return levels.run(on_level, charts if options.detail.flips == "chart" else None)


class _Levels:
    def __init__(
        self,
        source: Mesh,
        reference: Mesh,
        divisible: Bools,
        counts: Ints,
        options: Options,
    ) -> None:
        self._source, self._reference = source, reference
        self._divisible, self._counts, self._options = divisible.copy(), counts, options
        self._budget = options.detail.faces_allowed(len(source.faces))
        self._tolerance = options.detail.tolerance
        self._target = Target.of(reference, options.seed)
        prepared = PreparedReference.of(reference, len(source.vertices), options.seed)
        structure = SourceStructure.of(source, prepared, options.surface.noise_scale)
        self._lost = np.asarray(structure.lost[source.faces].any(axis=1))
        surface = {"fairness": _ROUNDS, "reverse_from": 0}
        self._quick = options.model_copy(
            update={
                "effort": "fast",
                "cones": ConeOptions(),
                "surface": options.surface.model_copy(update=surface),
                "solver": options.solver.model_copy(update={"certify": False}),
            }
        )

    def run(self, on_level: Callable[[int, int], None] | None, charts: Charts | None) -> Detail:
        """Divide until there is a reason to stop."""
        now, levels = DividedMesh.of(self._source), 0
        misses = self._misses(now)
        if self._reason_to_stop(now, misses) is None:
            now = self._moved(now)
            misses = self._misses(now)
        while (stopped := self._reason_to_stop(now, misses)) is None:
            require_time()
            if on_level is not None:
                on_level(self._faces(now), self._budget)
            found = self._level(now, misses)
            for _ in range(_RETRIES):
                found = found or self._level(now, misses)
            if found is None:
                stopped = "stagnation"
                break
            now, misses = found
            levels += 1
        swapped = None if charts is None else self._in_charts(now, misses, charts)
        if swapped is None:
            return Detail(now.subdivision(), levels, stopped, now.mesh.corners)
        division = replace(now.subdivision(), slots=swapped.slots)
        return Detail(division, levels, stopped, swapped.mesh.corners)

    def _reason_to_stop(self, now: DividedMesh, misses: Misses) -> Stopped | None:
        if misses.farthest <= max(self._tolerance, _ROUNDING):
            return "tolerance"
        faces = self._faces(now)
        is_spent = faces >= _FULL * self._budget or faces + _LEAST_ADDED > self._budget
        if is_spent or now.exponent >= MAX_EXPONENT:
            return "budget"
        return None

    def _level(self, now: DividedMesh, misses: Misses) -> tuple[DividedMesh, Misses] | None:
        """Split, move and swap; None if nothing can be split or it does not help."""
        counts, free = self._counts[now.parents], self._divisible_edges(now)
        marked = choose_edges(now.mesh, misses, free, self._limit(now), counts)
        if not marked.any():
            return None
        rest = now.split(marked)
        split = self._moved(rest)
        tried = [split]
        if self._options.detail.flips != "none":
            tried.insert(0, self._moved(flip_inside(split, self._target.tree)))
        for found in tried:
            after = self._misses(found)
            if after.total > (1 - _LEAST_HELP) * misses.total:
                continue
            tangled = self._tangled(found, rest)
            if tangled is None:
                return found, after
            self._divisible[tangled] = False
        return None

    def _in_charts(self, now: DividedMesh, misses: Misses, charts: Charts) -> Swapped | None:
        """Swap diagonals on sides of the source's faces, and move; None if it does not help.

        Faces that would pass through others keep their sides the next time.
        """
        there = self._crossings(now)
        for _ in range(1 + _RETRIES):
            found = flip_in_charts(now, charts, self._source, self._target.tree)
            if np.array_equal(found.mesh.faces, now.mesh.faces):
                return None
            answer = refine_surface(found.mesh, self._reference, self._quick, guarded=False)
            moved = replace(now, mesh=found.mesh.moved_to(answer.positions))
            here = self._crossings(moved)
            if here.sum() <= there.sum():
                helps = self._misses(moved).total <= misses.total
                return Swapped(moved.mesh, found.slots) if helps else None
            charts = charts.keeping(here > there)
        return None

    def _limit(self, now: DividedMesh) -> int:
        """How many faces the next level may have: equal growth until the budget is spent."""
        faces = self._faces(now)
        left = self._budget / faces
        grown = int(faces * left ** (1 / max(1, ceil(log(left) / log(_GROWTH)))))
        return min(self._budget, max(grown, faces + _FEWEST_ADDED * int(self._counts.max())))

    def _misses(self, now: DividedMesh) -> Misses:
        return Misses.of(now.mesh, self._target, self._lost[now.parents])

    def _faces(self, now: DividedMesh) -> int:
        return int(self._counts[now.parents].sum())

    def _moved(self, divided: DividedMesh) -> DividedMesh:
        answer = refine_surface(divided.mesh, self._reference, self._quick, guarded=False)
        return divided.moved_to(answer.positions)

    def _divisible_edges(self, now: DividedMesh) -> Bools:
        """(e,) edges that no face has which is to stay whole."""
        free = np.ones(len(now.mesh.edges), dtype=bool)
        free[edge_of_sides(now.mesh)[~self._divisible[now.parents]]] = False
        return free

    def _tangled(self, found: DividedMesh, rest: DividedMesh) -> Ints | None:
        """Faces of the source that pass through others where they did not at rest, if too many.

        Args:
            found: a level's answer.
            rest: the same faces where the level began: divided faces cross in more pairs.
        """
        allowed = max(_FEW_CROSSINGS, int(_CROSSING_SHARE * len(found.mesh.faces)))
        here, there = self._crossings(found), self._crossings(rest)
        if here.sum() - there.sum() <= 2 * allowed:
            return None
        return np.flatnonzero(here > there).astype(np.int64)

    def _crossings(self, divided: DividedMesh) -> Ints:
        """In how many pairs the parts of each face of the source pass through others, (m,)."""
        pairs = self_intersections(divided.mesh, self._options.quality.intersection_pairs)
        crossing = np.empty(0, dtype=np.int64) if pairs is None else divided.parents[pairs.ravel()]
        return np.bincount(crossing, minlength=divided.sources)
