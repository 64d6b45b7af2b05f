"""One round's program, the same arrays, by other solvers.

Each takes the reduced form, minimise ½ xᵀP x + cᵀx subject to b − A x ∈ K, with every cone
in it, and returns x.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy import sparse

from meshcone.options import SolverOptions
from meshcone.program.conic import ConicProgram
from meshcone.program.scs_solver import solve
from meshcone.surface.arrays import Floats

TOLERANCE = 1e-5
_ITERATIONS = 100_000


def by_scs(program: ConicProgram) -> Floats:
    """SCS on the arrays as they are."""
    options = SolverOptions(tolerance=TOLERANCE, max_iterations=_ITERATIONS)
    return solve(program, options).solution.x


def by_cvxpy(program: ConicProgram) -> Floats:
    """CVXPY's compilation of the program, solved by SCS at the same tolerance."""
    import cvxpy as cp

    x = cp.Variable(len(program.c))
    cost = cp.quad_form(x, cp.psd_wrap(program.P)) / 2 + program.c @ x
    constraints: list[cp.Constraint] = []
    row = 0
    for selection in program.selections:
        rows = slice(row, row + selection.size)
        slack = program.b[rows] - sparse.csr_array(program.A)[rows] @ x
        row += selection.size
        if selection.family.cone == "second_order":
            blocks = cp.reshape(slack, (-1, selection.family.dimension), order="C")
            constraints.append(cp.SOC(blocks[:, 0], blocks[:, 1:], axis=1))
        else:
            constraints.append(slack == 0 if selection.family.cone == "zero" else slack >= 0)
    problem = cp.Problem(cp.Minimize(cost), constraints)
    problem.solve(solver=cp.SCS, eps_abs=TOLERANCE, eps_rel=TOLERANCE, max_iters=_ITERATIONS)
    return np.asarray(x.value)


def by_clarabel(program: ConicProgram) -> Floats:
    """Clarabel's interior point method at its default tolerance."""
    import clarabel

    cones: list[object] = []
    for selection in program.selections:
        if selection.family.cone == "zero":
            cones.append(clarabel.ZeroConeT(selection.size))
        elif selection.family.cone == "linear":
            cones.append(clarabel.NonnegativeConeT(selection.size))
        else:
            dimension = selection.family.dimension
            cones += [clarabel.SecondOrderConeT(dimension)] * len(selection.which)
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    upper = sparse.triu(sparse.csc_matrix(program.P), format="csc")
    arrays = (upper, program.c, sparse.csc_matrix(program.A), program.b)
    return np.asarray(clarabel.DefaultSolver(*arrays, cones, settings).solve().x)


CONIC_PEERS: dict[str, Callable[[ConicProgram], Floats]] = {
    "scs, every cone": by_scs,
    "cvxpy and scs": by_cvxpy,
    "clarabel": by_clarabel,
}
