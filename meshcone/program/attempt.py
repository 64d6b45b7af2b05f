"""One setting's way through its rounds."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from meshcone.deadline import require_time
from meshcone.options import SolverOptions
from meshcone.program.answer import FinalProgram
from meshcone.program.cones import ConeFamily
from meshcone.program.diagnostics import RegionsRecord, RoundRecord
from meshcone.program.feasibility import require_feasible
from meshcone.program.multipliers import Multipliers
from meshcone.program.records import record_round
from meshcone.program.region_solver import solve_apart, solve_together, within_regions
from meshcone.program.regions import OVERLAP
from meshcone.program.request import RequestedCones
from meshcone.program.round_solver import RoundSolution, solve_round
from meshcone.program.surface_objective import SurfaceObjective
from meshcone.program.surface_problem import RoundObjective, SurfaceProblem
from meshcone.program.work import Allowance
from meshcone.surface.arrays import Bools, Floats

RoundCallback = Callable[[int, int], None]

# Rounds before the last only prepare the next one's data: their relaxation need not be
# solved beyond this share of its first gradient.
_INTERMEDIATE_REDUCTION = 1e-2
# What the last round after the schedule may take of the dual method, in systems and in products:
# about what all rounds before it take. It is a remedy, and there are others.
_REMEDY_WORK = (100, 2000)
# A round that moves no vertex by more than this share of the radius ends the refinement.
_STANDSTILL = 1e-7


@dataclass(frozen=True)
class _Place:
    """Where a round begins.

    Attributes:
        positions: (n, 3).
        known: multipliers of the round before.
        together: rounds so far that were finished as one program after regions.
        products: with its matrix, which that took.
    """

    positions: Floats
    known: Sequence[Multipliers]
    together: int
    products: int


@dataclass(frozen=True)
class Finish:
    """An attempt's last round.

    Attributes:
        round_index: which round it is, counted from 0.
        before: (n, 3) where it started.
        solution: its optimum.
    """

    round_index: int
    before: Floats
    solution: RoundSolution


class Attempt:
    """The rounds of one setting, solved as far as was asked for.

    Attributes:
        name: the setting's.
        positions: (n, 3) where the rounds so far have left the vertices.
        records: what happened in each.
        finish: the last round, once it is solved.
    """

    def __init__(
        self,
        name: str,
        problem: SurfaceProblem,
        options: SolverOptions,
        *,
        rounds: int | None = None,
    ) -> None:
        """Stand at the start; nothing is solved yet.

        Args:
            name: the setting's.
            problem: the pair under that setting.
            options: of the solvers.
            rounds: how many of the schedule's to solve; by default all.
        """
        self.name, self._problem, self._options = name, problem, options
        self._rounds = problem.rounds if rounds is None else rounds
        self.positions = problem.start
        self._solved = 0
        self.records: list[RoundRecord] = []
        self.finish: Finish | None = None
        self._known: Sequence[Multipliers] = ()
        self._path: list[_Place] = []  # where each of its rounds began
        self._final: FinalProgram | None = None
        # Rounds that were finished as one program after regions, and products with its matrix.
        self._together, self._products = 0, 0

    @property
    def request(self) -> RequestedCones:
        """The cones its answer has to satisfy."""
        return self._problem.request

    @property
    def exact(self) -> Bools:
        """(n,) which vertices of the input lie on the reference."""
        return self._problem.structure.exact

    @property
    def mended(self) -> Bools:
        """(n,) which vertices move where those that lie on the reference stay."""
        return self._problem.structure.mended

    @property
    def guards(self) -> int:
        """How many guard rounds may follow."""
        return self._problem.guarded_rounds - self._problem.rounds

    @property
    def regions(self) -> RegionsRecord | None:
        """How the mesh was divided, if it was."""
        regions = self._problem.regions
        if not regions:
            return None
        return RegionsRecord(
            count=len(regions),
            vertices=[len(region.own) for region in regions],
            solved_for=[len(region.free) for region in regions],
            overlap=OVERLAP,
            rounds=len(self.records),
            rounds_together=self._together,
            products_together=self._products,
        )

    @property
    def rounds_left(self) -> int:
        """Rounds that are not solved."""
        return 0 if self.finish is not None else self._rounds - self._solved

    def shortened(self, rounds: int) -> Attempt:
        """Return an attempt that ends after so many of this one's rounds.

        Its last one is left to solve: where others follow, a round is solved but loosely.
        """
        index, place = self.records[rounds - 1].round - 1, self._path[rounds - 1]
        further = self._beside(index, index + 1, place)
        further._path, further.records = self._path[: rounds - 1], self.records[: rounds - 1]
        return further

    def guarded(self) -> Attempt:
        """Return an attempt that goes on from this one's end with guard rounds, unsolved."""
        # A schedule that ended early leaves rounds out: guard rounds keep their numbers.
        first, last = self._problem.rounds, self._problem.guarded_rounds
        return self._beside(first, last, self._place)

    def holding(self, vertices: Bools) -> Attempt:
        """Return an attempt that gives (n,) vertices back to the input and fits the rest again.

        It goes on from this one's end and has one round to solve.
        """
        last, source = self._problem.all_rounds, self._problem.source.vertices
        given_back = np.where(vertices[:, None], source, self.positions)
        return self._beside(last - 1, last, replace(self._place, positions=given_back))

    def _beside(self, solved: int, rounds: int, place: _Place) -> Attempt:
        """Return an attempt with this one's rounds behind it, at a place, that ends at a round."""
        further = Attempt(self.name, self._problem, self._options, rounds=rounds)
        further._solved, further._path = solved, list(self._path)
        further.positions, further._known = place.positions, place.known
        further._together, further._products = place.together, place.products
        further.records = list(self.records)
        return further

    @property
    def _place(self) -> _Place:
        return _Place(self.positions, self._known, self._together, self._products)

    def after(self, rounds: int) -> Floats:
        """Return where so many of its rounds left the vertices, (n, 3)."""
        return self.positions if rounds == len(self._path) else self._path[rounds].positions

    def advance(self, rounds: int, count: Countdown) -> None:
        """Solve rounds until so many are, or the last one is.

        Raises:
            ContradictionError, SolveTimeoutError, InternalError: from the solvers.
        """
        while self.finish is None and self._solved < min(rounds, self._rounds):
            self.step(count)

    def complete(self, count: Countdown) -> Finish:
        """Solve all rounds that are left."""
        self.advance(self._rounds, count)
        assert self.finish is not None  # noqa: S101 - a schedule has a last round
        return self.finish

    def final(self) -> FinalProgram:
        """Return the last round's program, written again if it was let go of."""
        assert self.finish is not None  # noqa: S101 - asked of completed attempts only
        if self._final is None:
            index, before = self.finish.round_index, self.finish.before
            solution = self.finish.solution
            program = self._problem.program(index, before)
            answer = solution.positions, solution.multipliers
            self._final = FinalProgram(index, before, *program, *answer)
        return self._final

    def let_go(self) -> None:
        """Keep no program: it is large, and can be written again."""
        self._final = None

    def step(self, count: Countdown) -> None:
        """Solve one round.

        Raises:
            ContradictionError, SolveTimeoutError, InternalError: from the solvers.
        """
        require_time()
        started = time.perf_counter()
        index, place, before = self._solved, self._place, self.positions
        objective, families = self._problem.program(index, before)
        if index == 0:
            require_feasible(families, self._problem.source.vertices, self._options)
        last = index == self._rounds - 1
        solution = self._optimum(objective, families, last=last)
        if not last and float(np.abs(solution.positions - before).max()) < _STANDSTILL:
            last = True
            solution = self._optimum(objective, families, last=True)
        elapsed = time.perf_counter() - started
        self.records.append(record_round(index, solution, families, before, elapsed))
        self._path.append(place)
        self.positions, self._known = solution.positions, solution.multipliers
        self._solved += 1
        if last:
            self.finish = Finish(index, before, solution)
            self._final = FinalProgram(
                index, before, objective, families, solution.positions, solution.multipliers
            )
        count.advance(self._rounds - index if last else 1)

    def _optimum(
        self,
        objective: RoundObjective,
        families: Sequence[ConeFamily],
        *,
        last: bool,
    ) -> RoundSolution:
        """Solve a round's program, the last to its digits, in regions where there are any."""
        regions, known, options = self._problem.regions, self._known, self._options
        reduction = 0.0 if last else _INTERMEDIATE_REDUCTION
        start, count = self.positions, len(self.positions)
        afterwards = last and self._solved >= self._problem.rounds
        most = Allowance(*_REMEDY_WORK) if afterwards else None
        settled = self._problem.settled
        if not regions:
            return solve_round(
                objective, families, start, options, reduction, known, settled, allowance=most
            )
        # What is held leaves little to solve: it is not divided. Nor is a mesh parts of which
        # follow others, because they may do so from one region to the next.
        if isinstance(objective, SurfaceObjective) and within_regions(regions, known, count):
            apart = solve_apart(regions, objective, families, start, options, reduction, known)
            start, known = apart.positions, apart.multipliers
            if not last and within_regions(regions, known, count):
                return apart
        solution, products = solve_together(
            objective, families, start, options, reduction, known, settled, allowance=most
        )
        self._together, self._products = self._together + 1, self._products + products
        return solution


class Countdown:
    """Tells how many rounds are done.

    Args:
        callback: called with the rounds done and the rounds in all.
        total: the rounds in all, should each be needed.
    """

    def __init__(self, callback: RoundCallback | None, total: int) -> None:
        """Begin at none."""
        self._callback, self._total, self._done = callback, total, 0

    def advance(self, rounds: int) -> None:
        """Count rounds that are done, or will not be needed."""
        self._done = min(self._done + rounds, self._total)
        if self._callback is not None:
            self._callback(self._done, self._total)
