"""Running the surface formulation from the first round to the last, under several settings."""

from __future__ import annotations

import time
from dataclasses import replace
from functools import cached_property

import numpy as np

from meshcone.deadline import require_time
from meshcone.options import ConeOptions, Options
from meshcone.program.answer import RefinedPositions
from meshcone.program.attempt import Attempt, Countdown, RoundCallback
from meshcone.program.confirm import confirm_optimum
from meshcone.program.effort import Candidate, candidates
from meshcone.program.records import record_round
from meshcone.program.remedies import given_back, guarded_end
from meshcone.program.round_solver import RoundSolution, finish_by_scs
from meshcone.program.stretching import LARGEST, stretched
from meshcone.program.surface_problem import SurfaceProblems
from meshcone.quality.harm import Examined, HarmCheck
from meshcone.surface import Mesh, SurfaceTree, sample_surface
from meshcone.surface.arrays import Floats

_SCORING_SAMPLES = 4000
# Settings this close after the race finish both: the last rounds may turn them around.
_CLOSE_RACE = 1.1
# Where no attempt's last round will do, so many of each attempt's earlier ones may.
_LOOKED_AT_AGAIN = 2
# An answer this much farther away than it was in the race ends there.
_DRIFT = 1.05
# Where this share of the vertices lies on the reference, they may stay while the rest moves.
_MOSTLY = 0.5
# From this mean distance on, in the reference's radius, the source is stretched as well; but not
# where one of the two lies on the other within this distance in the mean.
_FAR, _ON_IT = 0.06, 0.02


class SurfaceRefiner:
    """Solves the problems of one pair and keeps the best answer that harms nothing.

    Args:
        problems: the pair under every setting.
        guarded: whether an answer that is worse than the input somewhere gives way to it.
    """

    def __init__(self, problems: SurfaceProblems, *, guarded: bool = True) -> None:
        self._problems, self._guarded = problems, guarded
        self._source, self._options = problems.source, problems.options
        self._raced: dict[Attempt, tuple[int, float]] = {}  # rounds, and the distance after them

    def run(self, on_round: RoundCallback | None = None) -> RefinedPositions:
        """Let the settings race, have the one closest to the reference finish, and confirm it.

        Args:
            on_round: called with the rounds done and the rounds in all.
        """
        if not self._options.surface.fairness:
            return RefinedPositions(self._source.vertices, [], None)
        every = candidates(self._options)
        tried = [candidate for candidate in every if candidate.is_always_tried]
        attempts = [self._attempt(candidate) for candidate in tried]
        harm = self._harm_check(attempts[0])
        for candidate in every:
            if (candidate.stretched and self._is_far(harm)) or (
                candidate.holding and self._is_mostly_right(attempts[0])
            ):
                tried.append(candidate)
                attempts.append(self._attempt(candidate))
        count = Countdown(on_round, sum(len(c.options.fairness) for c in tried))
        ahead = self._ahead(attempts, [c.heat for c in tried], count)
        for attempt in ahead:
            attempt.complete(count)
            if attempt is not ahead[0]:
                attempt.let_go()
        if len(ahead) > 1:
            ahead = self._by_score(ahead)
        ranked = [*ahead, *(attempt for attempt in attempts if attempt not in ahead)]
        if not self._guarded:
            return self._confirmed(ranked[0], ranked[0].complete(count).solution)
        return self._first_harmless(ranked, harm, count)

    def _harm_check(self, attempt: Attempt) -> HarmCheck:
        return HarmCheck(
            self._source,
            self._problems.reference,
            self._problems.prepared.tree,
            self._options.quality.intersection_pairs,
            # Where the input is where no answer may be, every answer may be farther away.
            distances=not attempt.request.strays(self._source),
        )

    def _is_far(self, harm: HarmCheck) -> bool:
        """Tell whether the source is so far away that closest points mislead it.

        A source that is a part of its reference lies on it, however far that goes on: stretching
        would spread it over what it lacks. What a caller asks of the answer is asked of the source;
        stretched it is another mesh.
        """
        free = self._options.cones == ConeOptions() and self._problems.start is None
        small = len(self._source.vertices) <= LARGEST
        distances = harm.input.distances
        nearer = float(distances.sampled.mean(axis=1).min())
        return free and small and distances.mean > _FAR and nearer > _ON_IT

    def _is_mostly_right(self, attempt: Attempt) -> bool:
        """Tell whether most vertices lie on the reference, and some of the same pieces do not."""
        free = self._options.cones == ConeOptions() and self._problems.start is None
        return free and float(attempt.exact.mean()) >= _MOSTLY and bool(attempt.mended.any())

    def _attempt(self, candidate: Candidate) -> Attempt:
        problem = self._problems.problem(candidate)
        if candidate.stretched:
            start = stretched(self._source, problem.reference, problem.structure)
            problem = replace(problem, start=start)
        return Attempt(candidate.name, problem, self._options.solver)

    def _ahead(self, attempts: list[Attempt], heats: list[int], count: Countdown) -> list[Attempt]:
        """Solve the rounds of the race, and return the attempts close enough to the best."""
        if len(attempts) == 1:
            return attempts
        for attempt, heat in zip(attempts, heats, strict=True):
            attempt.advance(heat, count)
            attempt.let_go()
        scores = {attempt: self._score(attempt.positions) for attempt in attempts}
        limit = _CLOSE_RACE * min(scores.values())
        for attempt, heat in zip(attempts, heats, strict=True):
            self._raced[attempt] = heat, scores[attempt]
            if scores[attempt] > limit:
                count.advance(attempt.rounds_left)
        ranked = sorted(attempts, key=lambda attempt: scores[attempt])
        return [attempt for attempt in ranked if scores[attempt] <= limit]

    def _by_score(self, attempts: list[Attempt]) -> list[Attempt]:
        return sorted(attempts, key=lambda attempt: self._score(attempt.positions))

    def _first_harmless(
        self, attempts: list[Attempt], harm: HarmCheck, count: Countdown
    ) -> RefinedPositions:
        """Confirm the first answer that nothing speaks against; else keep the input."""
        reasons: list[str] = []
        for attempt in attempts:
            answer, objections = self._if_harmless(attempt, harm, count)
            if answer is not None:
                return answer
            reasons = reasons or objections
        for attempt in attempts:
            answer = self._earlier(attempt, harm)
            if answer is not None:
                return answer
        best = attempts[0]
        return RefinedPositions(
            self._source.vertices, best.records, None, best.name, kept_because=tuple(reasons)
        )

    def _if_harmless(
        self, attempt: Attempt, harm: HarmCheck, count: Countdown
    ) -> tuple[RefinedPositions | None, list[str]]:
        """Complete an attempt; confirm its answer, or say what speaks against it."""
        require_time()
        attempt, found = self._ended(attempt, harm, count)
        solution = attempt.complete(count).solution
        mended = guarded_end(attempt, harm, found)
        if mended is None and found.objections:
            mended = given_back(attempt, harm, found)
        if mended is not None:
            attempt.let_go()
            attempt, found = mended
            solution = attempt.complete(count).solution
        if not found.objections:
            answer = self._confirmed(attempt, solution)
            # SCS may have gone on from where the dual method's budget was spent.
            if not solution.converged:
                found = harm.examine(answer.positions)
            if not found.objections:
                return replace(answer, gain=harm.gain(found)), []
        attempt.let_go()
        return None, found.objections

    def _ended(
        self, attempt: Attempt, harm: HarmCheck, count: Countdown
    ) -> tuple[Attempt, Examined]:
        """Complete an attempt; where its last rounds led away, end it where it raced.

        Samples of faces that reach for a wrong sheet of the reference drag the mesh there.
        """
        positions = attempt.complete(count).solution.positions
        rounds, raced = self._raced.get(attempt, (0, np.inf))
        if np.isfinite(raced) and (reached := self._score(positions)) > _DRIFT * raced:
            shorter = attempt.shortened(min(rounds, len(attempt.records)))
            earlier = shorter.complete(Countdown(None, 0)).solution.positions
            if self._score(earlier) < reached:
                attempt.let_go()
                return shorter, harm.examine(earlier)
        return attempt, harm.examine(positions)

    def _earlier(self, attempt: Attempt, harm: HarmCheck) -> RefinedPositions | None:
        """Confirm the last round of an attempt whose answer nothing speaks against.

        The last rounds smooth least: faces may pass through each other there that did not
        before, for little more closeness. An answer that is farther away at its end has no
        better round; the first round is none of a start elsewhere.
        """
        assert attempt.finish is not None  # noqa: S101 - asked of completed attempts only
        end = harm.examine(attempt.finish.solution.positions)
        if end.distances.mean >= harm.input.distances.mean:
            return None
        looked_at = 0
        for rounds in range(len(attempt.records) - 1, 1, -1):
            if harm.objections(attempt.after(rounds)):
                continue
            # Rounds before the last are solved loosely: their optima may be worse than they are.
            answer, _ = self._if_harmless(attempt.shortened(rounds), harm, Countdown(None, 0))
            looked_at += 1
            if answer is not None or looked_at == _LOOKED_AT_AGAIN:
                return answer
        return None

    def _score(self, positions: Floats) -> float:
        """Return the mean point-to-surface distance, over samples both ways."""
        require_time()
        mesh = self._source.moved_to(positions)
        samples = sample_surface(mesh, _SCORING_SAMPLES, self._options.seed).in_space()
        there = self._problems.prepared.tree.closest(samples.points).distances.mean()
        back = SurfaceTree(mesh).closest(self._target).distances.mean()
        return float((there + back) / 2)

    @cached_property
    def _target(self) -> Floats:
        """Samples of the reference to score against."""
        reference, seed = self._problems.reference, self._options.seed + 1
        return sample_surface(reference, _SCORING_SAMPLES, seed).in_space().points

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
            regions=attempt.regions,
        )

    def _asks_scs(self, solution: RoundSolution) -> bool:
        """Whether SCS is to confirm: the options ask for it, and it did not solve the round."""
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
