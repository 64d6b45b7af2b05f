"""One setting's way through its rounds."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from meshcone.deadline import require_time
from meshcone.options import SolverOptions
from meshcone.program.answer import FinalProgram
from meshcone.program.cones import ConeFamily
from meshcone.program.diagnostics import RegionsRecord, RoundRecord
from meshcone.program.feasibility import require_feasible
from meshcone.program.held import HeldObjective
from meshcone.program.multipliers import Multipliers
from meshcone.program.records import record_round
from meshcone.program.region_solver import solve_apart, solve_together, within_regions
from meshcone.program.regions import OVERLAP
from meshcone.program.request import RequestedCones
from meshcone.program.round_solver import RoundSolution, solve_round
from meshcone.program.surface_objective import SurfaceObjective
from meshcone.program.surface_problem import SurfaceProblem
from meshcone.surface.arrays import Bools, Floats

RoundCallback = Callable[[int, int], None]

# Rounds before the last only prepare the next one's data: their relaxation need not be
# solved beyond this share of its first gradient.
_INTERMEDIATE_REDUCTION = 1e-2
# A round that moves no vertex by more than this share of the radius ends the refinement.
_STANDSTILL = 1e-7


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
        self._final: FinalProgram | None = None
        # Rounds that were finished as one program after regions, and its products with its matrix.
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
        """Return an attempt from the same start that ends after fewer rounds, unsolved."""
        return Attempt(self.name, self._problem, self._options, rounds=rounds)

    def guarded(self) -> Attempt:
        """Return an attempt that goes on from this one's end with guard rounds, unsolved."""
        last = self._problem.guarded_rounds
        further = Attempt(self.name, self._problem, self._options, rounds=last)
        # A schedule that ended early leaves rounds out: guard rounds keep their numbers.
        further._solved = self._problem.rounds
        further.positions, further._known = self.positions, self._known
        further.records = list(self.records)
        return further

    def holding(self, vertices: Bools) -> Attempt:
        """Return an attempt that gives (n,) vertices back to the input and fits the rest again.

        It goes on from this one's end and has one round to solve.
        """
        last = self._problem.all_rounds
        further = Attempt(self.name, self._problem, self._options, rounds=last)
        further._solved = last - 1
        source = self._problem.source.vertices
        further.positions = np.where(vertices[:, None], source, self.positions)
        further._known, further.records = self._known, list(self.records)
        return further

    def advance(self, rounds: int, count: Countdown) -> None:
        """Solve rounds until so many are, or the last one is.

        Raises:
            ContradictionError, SolveTimeoutError, InternalError: from the solvers.
        """
        while self.finish is None and self._solved < min(rounds, self._rounds):
            self._solve_next(count)

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

    def _solve_next(self, count: Countdown) -> None:
        require_time()
        started = time.perf_counter()
        index, before = self._solved, self.positions
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
        objective: SurfaceObjective | HeldObjective,
        families: Sequence[ConeFamily],
        *,
        last: bool,
    ) -> RoundSolution:
        """Solve a round's program, the last to its digits, in regions where there are any."""
        regions, known, options = self._problem.regions, self._known, self._options
        reduction = 0.0 if last else _INTERMEDIATE_REDUCTION
        start, count = self.positions, len(self.positions)
        if not regions:
            return solve_round(
                objective, families, start, options, reduction=reduction, known=known
            )
        # What is held leaves little to solve: it is not divided.
        if isinstance(objective, SurfaceObjective) and within_regions(regions, known, count):
            apart = solve_apart(
                regions, objective, families, start, options, reduction=reduction, known=known
            )
            start, known = apart.positions, apart.multipliers
            if not last and within_regions(regions, known, count):
                return apart
        solution, products = solve_together(
            objective, families, start, options, reduction=reduction, known=known
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
