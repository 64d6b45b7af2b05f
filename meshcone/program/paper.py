"""Solving the paper's program: one round, one answer."""

from __future__ import annotations

import time

from meshcone.options import Options
from meshcone.program.answer import FinalProgram, RefinedPositions
from meshcone.program.centroid import centroid_program
from meshcone.program.conic import assemble, everything
from meshcone.program.multipliers import unflatten
from meshcone.program.records import record_round
from meshcone.program.round_solver import RoundSolution
from meshcone.program.scs_solver import certifiable, solve
from meshcone.surface import Mesh


def refine_centroid(source: Mesh, reference: Mesh, options: Options) -> RefinedPositions:
    """Solve the paper's program and undo its shrink.

    Args:
        source: in the reference's frame.
        reference: in its own frame.
        options: ``options.centroid`` and ``options.solver`` are read.
    """
    started = time.perf_counter()
    objective, caps, copied = centroid_program(source, reference, options)
    if options.centroid.form == "cvxpy":
        # CVXPY takes longer to import than most refinements to solve.
        from meshcone.program.model import solve_centroid_model

        optimum, multipliers, record = solve_centroid_model(
            objective, caps, certifiable(options.solver), source.vertices
        )
    else:
        program = assemble(objective, everything([caps]))
        run = solve(program, certifiable(options.solver))
        optimum = run.solution.x.reshape(-1, 3)
        multipliers = unflatten(run.solution.y, program.selections, program.c)
        solution = RoundSolution(optimum, multipliers, "scs", 1, program, run)
        record = record_round(0, solution, [caps], source.vertices, time.perf_counter() - started)
    final = FinalProgram(0, source.vertices, objective, [caps], optimum, multipliers)
    return RefinedPositions(
        objective.undo_shrink(optimum), [record], final, copied_reference=copied
    )
