"""Running the surface formulation from the first round to the last, under several settings."""

from __future__ import annotations

import time
from dataclasses import replace

from meshcone.deadline import require_time
from meshcone.options import Options
from meshcone.program.answer import RefinedPositions
from meshcone.program.attempt import Attempt, Countdown, RoundCallback
from meshcone.program.confirm import confirm_optimum
from meshcone.program.effort import candidates
from meshcone.program.records import record_round
from meshcone.program.round_solver import RoundSolution, finish_by_scs
from meshcone.program.surface_problem import SurfaceProblems
from meshcone.quality.harm import HarmCheck
from meshcone.surface import Mesh, SurfaceTree, sample_surface
from meshcone.surface.arrays import Floats

_SCORING_SAMPLES = 4000
# Settings this close after the race finish both: the last rounds may turn them around.
_CLOSE_RACE = 1.1


class SurfaceRefiner:
    """Solves the problems of one pair and keeps the best answer that harms nothing.

    Args:
        problems: the pair under every setting.
        guarded: whether an answer that is worse than the input somewhere gives way to it.
    """

    def __init__(self, problems: SurfaceProblems, *, guarded: bool = True) -> None:
        self._problems, self._guarded = problems, guarded
        self._source, self._options = problems.source, problems.options

    def run(self, on_round: RoundCallback | None = None) -> RefinedPositions:
        """Let the settings race, have the one closest to the reference finish, and confirm it.

        Args:
            on_round: called with the rounds done and the rounds in all.
        """
        if not self._options.surface.fairness:
            return RefinedPositions(self._source.vertices, [], None)
        tried = candidates(self._options)
        count = Countdown(on_round, sum(len(c.options.fairness) for c in tried))
        attempts = [Attempt(c.name, self._problems.problem(c), self._options.solver) for c in tried]
        ahead = self._ahead(attempts, [c.heat for c in tried], count)
        for attempt in ahead:
            attempt.complete(count)
            if attempt is not ahead[0]:
                attempt.let_go()
        if len(ahead) > 1:
            ahead = self._by_score(ahead)
        return self._first_harmless([*ahead, *(a for a in attempts if a not in ahead)], count)

    def _ahead(self, attempts: list[Attempt], heats: list[int], count: Countdown) -> list[Attempt]:
        """Solve the rounds of the race, and return the attempts close enough to the best."""
        if len(attempts) == 1:
            return attempts
        for attempt, heat in zip(attempts, heats, strict=True):
            attempt.advance(heat, count)
            attempt.let_go()
        scores = {attempt: self._score(attempt.positions) for attempt in attempts}
        limit = _CLOSE_RACE * min(scores.values())
        for attempt in attempts:
            if scores[attempt] > limit:
                count.advance(attempt.rounds_left)
        ranked = sorted(attempts, key=lambda attempt: scores[attempt])
        return [attempt for attempt in ranked if scores[attempt] <= limit]

    def _by_score(self, attempts: list[Attempt]) -> list[Attempt]:
        return sorted(attempts, key=lambda attempt: self._score(attempt.positions))

    def _first_harmless(self, attempts: list[Attempt], count: Countdown) -> RefinedPositions:
        """Confirm the first answer that nothing speaks against; else keep the input."""
        if not self._guarded:
            return self._confirmed(attempts[0], attempts[0].complete(count).solution)
        reasons: tuple[str, ...] = ()
        harm = HarmCheck(
            self._source,
            self._problems.reference,
            self._problems.prepared.tree,
            self._options.quality.intersection_pairs,
            distances=not self._has_to_leave(attempts[0]),
        )
        for attempt in attempts:
            require_time()
            solution = attempt.complete(count).solution
            found = harm.objections(solution.positions)
            if not found:
                answer = self._confirmed(attempt, solution)
                # SCS may have gone on from where the dual method's budget was spent.
                found = [] if solution.converged else harm.objections(answer.positions)
                if not found:
                    return answer
            attempt.let_go()
            reasons = reasons or tuple(found)
        best = attempts[0]
        return RefinedPositions(
            self._source.vertices, best.records, None, best.name, kept_because=reasons
        )

    def _has_to_leave(self, attempt: Attempt) -> bool:
        """Whether the input is where no answer may be: then every answer may be farther away."""
        return attempt.request.strays(self._source)

    def _score(self, positions: Floats) -> float:
        """Return the mean point-to-surface distance, over samples both ways."""
        require_time()
        mesh = self._source.moved_to(positions)
        samples = sample_surface(mesh, _SCORING_SAMPLES, self._options.seed)
        there = self._problems.prepared.tree.closest(samples.points).distances.mean()
        target = sample_surface(self._problems.reference, _SCORING_SAMPLES, self._options.seed + 1)
        back = SurfaceTree(mesh).closest(target.points).distances.mean()
        return float((there + back) / 2)

    def _confirmed(self, attempt: Attempt, solution: RoundSolution) -> RefinedPositions:
        started = time.perf_counter()
        options, final, records = self._options.solver, attempt.final(), attempt.records
        if not solution.converged:
            solution = finish_by_scs(final.objective, final.families, solution, options)
            final = replace(final, positions=solution.positions, multipliers=solution.multipliers)
            seconds = records[-1].seconds + time.perf_counter() - started
            last = record_round(final.round_index, solution, final.families, final.before, seconds)
            records = [*records[:-1], last]
        elif self._asks_scs(solution):
            last = confirm_optimum(final.objective, final.families, solution, records[-1], options)
            records = [*records[:-1], last]
        return RefinedPositions(
            final.positions,
            records,
            final,
            attempt.name,
            confirm_seconds=time.perf_counter() - started,
        )

    def _asks_scs(self, solution: RoundSolution) -> bool:
        """Tell whether SCS is to confirm: it was not the one who solved, and is not spared."""
        options = self._options.solver
        small = len(self._source.vertices) <= options.certify_limit
        return options.certify and small and solution.run is None


def refine_surface(
    source: Mesh,
    reference: Mesh,
    options: Options,
    on_round: RoundCallback | None = None,
    *,
    guarded: bool = True,
) -> RefinedPositions:
    """Solve the surface program round by round.

    Args:
        source: in the reference's frame.
        reference: in its own frame.
        options: ``effort``, ``surface``, ``cones``, ``solver`` and ``seed`` are read.
        on_round: called with the rounds done and the rounds in all.
        guarded: whether an answer that is worse than the input somewhere gives way to it.
    """
    problems = SurfaceProblems(source, reference, options)
    return SurfaceRefiner(problems, guarded=guarded).run(on_round)
