"""Solving a formulated pair: the half of the engine that needs a solver."""

from __future__ import annotations

from dataclasses import replace

from meshcone.formulation import CentroidFormulation, SurfaceFormulation
from meshcone.program.answer import RefinedPositions
from meshcone.program.attempt import RoundCallback
from meshcone.program.paper import refine_centroid
from meshcone.program.rounds import SurfaceRefiner


def solve(
    problem: SurfaceFormulation | CentroidFormulation, on_round: RoundCallback
) -> RefinedPositions:
    """Solve it.

    Args:
        problem: the formulated pair.
        on_round: called with the rounds done and the rounds in all.
    """
    if isinstance(problem, SurfaceFormulation):
        answer = SurfaceRefiner(problem.problems).run(on_round)
        positions = problem.settled(problem.out_of_program(answer.positions))
        return replace(answer, positions=positions)
    answer = refine_centroid(problem.pair.source, problem.pair.reference, problem.options)
    on_round(1, 1)
    return answer
