"""The program without its cones: one symmetric positive definite system, solved by CG.

If its solution violates no cone it is the optimum of the whole program; otherwise it is
where the conic solver starts.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from scipy.sparse.linalg import LinearOperator, cg

from meshcone.errors import InternalError
from meshcone.program.conic import QuadraticObjective
from meshcone.surface.arrays import Floats

TIGHT = 1e-7
_ITERATION_LIMIT = 5000


class PreconditionedObjective(QuadraticObjective, Protocol):
    """An objective that also knows the diagonal of P."""

    def diagonal(self) -> Floats:
        """Return the diagonal of P, (3n,)."""


def solve_relaxation(
    objective: PreconditionedObjective, start: Floats, tolerance: float = TIGHT
) -> Floats:
    """Minimise the objective without constraints, by Jacobi-preconditioned CG.

    Args:
        objective: strictly convex.
        start: (3n,) first guess.
        tolerance: the gradient is reduced below this share of the objective's linear term.

    Returns:
        The minimiser (3n,).

    Raises:
        InternalError: CG did not converge.
    """
    size = len(start)
    inverse = 1 / objective.diagonal()
    operator = LinearOperator((size, size), matvec=objective.apply, dtype=np.float64)
    preconditioner = LinearOperator((size, size), matvec=lambda x: inverse * x, dtype=np.float64)
    x, code = cg(
        operator,
        -objective.linear,
        x0=start,
        rtol=tolerance,
        maxiter=_ITERATION_LIMIT,
        M=preconditioner,
    )
    if code != 0:
        raise InternalError("the conjugate gradient method did not converge")
    return np.asarray(x)
