"""Writing down what happened in a round."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from meshcone.program.cones import ConeFamily
from meshcone.program.conic import ConicProgram
from meshcone.program.diagnostics import ProgramSizes, RoundRecord
from meshcone.program.multipliers import active_cones
from meshcone.program.round_solver import RoundSolution
from meshcone.surface.arrays import Floats


def record_round(
    round_index: int,
    solution: RoundSolution,
    families: Sequence[ConeFamily],
    before: Floats,
    seconds: float,
) -> RoundRecord:
    """Describe a solved round.

    Args:
        round_index: counted from 0.
        solution: its optimum.
        families: every constraint of its program.
        before: (n, 3) positions before it.
        seconds: wall time of building and solving it.
    """
    run = solution.run
    moves = np.sum((solution.positions - before) ** 2, axis=1)
    return RoundRecord(
        round=round_index + 1,
        method=solution.method,
        passes=solution.passes,
        seconds=seconds,
        sizes=None if run is None or solution.program is None else sizes_of(solution.program),
        info=None if run is None else run.info,
        active_cones=active_cones(families, solution.multipliers),
        largest_violation=max(
            (float(family.violation(solution.positions).max(initial=0)) for family in families),
            default=0.0,
        ),
        movement=float(np.sqrt(moves.mean())),
        history={} if run is None else run.history,
    )


def sizes_of(program: ConicProgram) -> ProgramSizes:
    """Count a program's rows, columns, cones and non-zeros."""
    cones: dict[str, int] = {}
    rows = {"zero": 0, "linear": 0, "second_order": 0}
    for selection in program.selections:
        family = selection.family
        cones[family.kind] = cones.get(family.kind, 0) + len(selection.which)
        rows[family.cone] += selection.size
    diagonal = int(np.count_nonzero(program.P.diagonal()))
    return ProgramSizes(
        variables=len(program.c),
        constraints=len(program.b),
        cones=cones,
        nnz_A=program.A.nnz,
        nnz_P=(program.P.nnz + diagonal) // 2,
        **rows,
    )
