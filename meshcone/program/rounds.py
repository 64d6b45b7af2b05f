"""Running the surface formulation from the first round to the last, under several settings."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from meshcone.deadline import require_time
from meshcone.errors import InternalError
from meshcone.options import Options
from meshcone.program.answer import FinalProgram, RefinedPositions
from meshcone.program.cones import ConeFamily
from meshcone.program.confirm import confirm_optimum
from meshcone.program.diagnostics import RoundRecord
from meshcone.program.effort import Candidate, candidates
from meshcone.program.feasibility import require_feasible
from meshcone.program.multipliers import Multipliers
from meshcone.program.records import record_round
from meshcone.program.round_solver import RoundSolution, finish_by_scs, solve_round
from meshcone.program.surface_objective import SurfaceObjective
from meshcone.program.surface_problem import SurfaceProblems
from meshcone.quality.harm import HarmCheck
from meshcone.surface import Mesh, SurfaceTree, sample_surface
from meshcone.surface.arrays import Floats

RoundCallback = Callable[[int, int], None]

# Rounds before the last only prepare the next one's data: their relaxation need not be
# solved beyond this share of its first gradient.
_INTERMEDIATE_REDUCTION = 1e-2
# A round that moves no vertex by more than this share of the radius ends the refinement.
_STANDSTILL = 1e-7
_SCORING_SAMPLES = 4000


@dataclass(frozen=True)
class _CandidateRun:
    """A setting's last round; ``final`` is let go of where another setting came closer."""

    candidate: Candidate
    round_index: int
    before: Floats
    final: FinalProgram | None
    solution: RoundSolution
    records: list[RoundRecord]
    score: float


class SurfaceRefiner:
    """Solves the problems of one pair and keeps the best answer that harms nothing.

    Args:
        problems: the pair under every setting.
    """

    def __init__(self, problems: SurfaceProblems) -> None:
        self._problems = problems
        self._source, self._options = problems.source, problems.options

    def run(self, on_round: RoundCallback | None = None) -> RefinedPositions:
        """Refine under each setting, keep the one closest to the reference, confirm it.

        Args:
            on_round: called with the rounds done and the rounds in all.
        """
        if not self._options.surface.fairness:
            return RefinedPositions(self._source.vertices, [], None)
        tried = candidates(self._options)
        count = _Countdown(on_round, sum(len(c.options.fairness) for c in tried))
        runs: list[_CandidateRun] = []
        for candidate in tried:
            runs.append(self._run_one(candidate, count, scored=len(tried) > 1))
            runs.sort(key=lambda run: run.score)
            # A program is large: never hold more than two.
            runs[1:] = [replace(run, final=None) for run in runs[1:]]
        return self._first_harmless(runs)

    def _first_harmless(self, runs: Sequence[_CandidateRun]) -> RefinedPositions:
        """Confirm the closest answer that nothing speaks against; else keep the input."""
        reasons: tuple[str, ...] = ()
        harm = HarmCheck(
            self._source,
            self._problems.reference,
            self._problems.prepared.tree,
            self._options.quality.intersection_pairs,
        )
        for run in runs:
            require_time()
            found = harm.objections(run.solution.positions)
            if not found:
                answer = self._confirmed(run)
                # SCS may have gone on from where the dual method's budget was spent.
                found = [] if run.solution.converged else harm.objections(answer.positions)
                if not found:
                    return answer
            reasons = reasons or tuple(found)
        best = runs[0]
        return RefinedPositions(
            self._source.vertices, best.records, None, best.candidate.name, kept_because=reasons
        )

    def _run_one(self, candidate: Candidate, count: _Countdown, *, scored: bool) -> _CandidateRun:
        problem = self._problems.problem(candidate)
        before, records = self._source.vertices, []
        known: Sequence[Multipliers] = ()
        for index in range(problem.rounds):
            require_time()
            started = time.perf_counter()
            objective, families = problem.program(index, before)
            if index == 0:
                require_feasible(families, before, self._options.solver)
            last = index == problem.rounds - 1
            reduction = 0.0 if last else _INTERMEDIATE_REDUCTION
            solution = self._solve(objective, families, before, reduction, known)
            if not last and float(np.abs(solution.positions - before).max()) < _STANDSTILL:
                last, solution = True, self._solve(objective, families, before, 0.0, known)
            elapsed = time.perf_counter() - started
            records.append(record_round(index, solution, families, before, elapsed))
            count.advance(problem.rounds - index if last else 1)
            if last:
                final = FinalProgram(
                    index, before, objective, families, solution.positions, solution.multipliers
                )
                score = self._score(solution.positions) if scored else 0.0
                return _CandidateRun(candidate, index, before, final, solution, records, score)
            before, known = solution.positions, solution.multipliers
        raise InternalError("the schedule has no rounds")

    def _solve(
        self,
        objective: SurfaceObjective,
        families: list[ConeFamily],
        before: Floats,
        reduction: float,
        known: Sequence[Multipliers],
    ) -> RoundSolution:
        options = self._options.solver
        return solve_round(objective, families, before, options, reduction=reduction, known=known)

    def _score(self, positions: Floats) -> float:
        """Return the mean point-to-surface distance, over samples both ways."""
        require_time()
        mesh = self._source.moved_to(positions)
        samples = sample_surface(mesh, _SCORING_SAMPLES, self._options.seed)
        there = self._problems.prepared.tree.closest(samples.points).distances.mean()
        target = sample_surface(self._problems.reference, _SCORING_SAMPLES, self._options.seed + 1)
        back = SurfaceTree(mesh).closest(target.points).distances.mean()
        return float((there + back) / 2)

    def _confirmed(self, best: _CandidateRun) -> RefinedPositions:
        started = time.perf_counter()
        options, final, records = self._options.solver, self._final(best), best.records
        if not best.solution.converged:
            solution = finish_by_scs(final.objective, final.families, best.solution, options)
            final = replace(final, positions=solution.positions, multipliers=solution.multipliers)
            seconds = records[-1].seconds + time.perf_counter() - started
            last = record_round(final.round_index, solution, final.families, final.before, seconds)
            records = [*records[:-1], last]
        elif self._asks_scs(best):
            last = confirm_optimum(
                final.objective, final.families, best.solution, records[-1], options
            )
            records = [*records[:-1], last]
        return RefinedPositions(
            final.positions,
            records,
            final,
            best.candidate.name,
            confirm_seconds=time.perf_counter() - started,
        )

    def _final(self, run: _CandidateRun) -> FinalProgram:
        """Return a run's last program, written again if it was let go of."""
        if run.final is not None:
            return run.final
        program = self._problems.problem(run.candidate).program(run.round_index, run.before)
        answer = run.solution.positions, run.solution.multipliers
        return FinalProgram(run.round_index, run.before, *program, *answer)

    def _asks_scs(self, best: _CandidateRun) -> bool:
        """Tell whether SCS is to confirm: it was not the one who solved, and is not spared."""
        options = self._options.solver
        small = len(self._source.vertices) <= options.certify_limit
        return options.certify and small and best.solution.run is None


class _Countdown:
    def __init__(self, callback: RoundCallback | None, total: int) -> None:
        self._callback, self._total, self._done = callback, total, 0

    def advance(self, rounds: int) -> None:
        self._done += rounds
        if self._callback is not None:
            self._callback(self._done, self._total)


def refine_surface(
    source: Mesh, reference: Mesh, options: Options, on_round: RoundCallback | None = None
) -> RefinedPositions:
    """Solve the surface program round by round.

    Args:
        source: in the reference's frame.
        reference: in its own frame.
        options: ``effort``, ``surface``, ``cones``, ``solver`` and ``seed`` are read.
        on_round: called with the rounds done and the rounds in all.
    """
    return SurfaceRefiner(SurfaceProblems(source, reference, options)).run(on_round)
