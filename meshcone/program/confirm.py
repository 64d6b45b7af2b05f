"""Asking SCS whether an optimum found otherwise is one.

SCS is started at the point with its multipliers and slacks; if its own termination test
holds there it stops at once, else it goes on from there. Every cone is in the program it
sees, so that its word is about the whole of it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from meshcone.options import SolverOptions
from meshcone.program.cones import ConeFamily
from meshcone.program.conic import QuadraticObjective, assemble, everything
from meshcone.program.diagnostics import RoundRecord
from meshcone.program.multipliers import flatten
from meshcone.program.projection import project_dual
from meshcone.program.records import sizes_of
from meshcone.program.round_solver import RoundSolution
from meshcone.program.scs_solver import PrimalDual, agreement, solve


def confirm_optimum(
    objective: QuadraticObjective,
    families: Sequence[ConeFamily],
    solution: RoundSolution,
    record: RoundRecord,
    options: SolverOptions,
) -> RoundRecord:
    """Run SCS from an optimum over every cone and add its account to the round's record.

    With ``linear_solver: auto`` the indirect solver is used: from an optimum SCS needs next
    to no linear solves, and a factorisation would cost more than everything before it.
    """
    program = assemble(objective, everything(families))
    x = solution.positions.ravel()
    y = flatten(solution.multipliers, program.selections)
    # The cones are their own duals but for the zero cone, whose slack is zero.
    slack = program.b - program.A @ x
    feasible = project_dual(slack, program.selections)
    zero_rows = sum(s.size for s in program.selections if s.family.cone == "zero")
    feasible[:zero_rows] = 0
    linear_solver = options.linear_solver
    if linear_solver == "auto":
        linear_solver = "cpu_indirect"
    options = options.model_copy(update={"linear_solver": linear_solver})
    point = PrimalDual(x, y, np.asarray(feasible))
    run = agreement(program, options, point) or solve(program, options, point)
    return record.model_copy(
        update={"sizes": sizes_of(program), "info": run.info, "history": run.history}
    )
