"""The program without its cones: one symmetric positive definite system, solved by CG.

If its solution violates no cone it is the optimum of the whole program; otherwise it is
where the conic solver starts.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from scipy.sparse.linalg import LinearOperator, cg

from meshcone.deadline import require_time
from meshcone.errors import InputError
from meshcone.program.conic import QuadraticObjective
from meshcone.program.fused import multiply_blocks
from meshcone.program.vertex_blocks import VertexBlocks
from meshcone.surface.arrays import Floats

_TIGHT = 1e-7
_ITERATION_LIMIT = 5000


class PreconditionedObjective(QuadraticObjective, Protocol):
    """An objective that also knows the blocks on the diagonal of P."""

    def diagonal_blocks(self) -> VertexBlocks:
        """Return the 3×3 blocks of P that couple each vertex with itself."""

    def product(self) -> Callable[[Floats], Floats]:
        """Return x ↦ P x as a function worth its preparation when it is called dozens of times."""


def solve_relaxation(
    objective: PreconditionedObjective, start: Floats, reduction: float = 0.0
) -> Floats:
    """Minimise the objective without constraints, by CG, preconditioned vertex by vertex.

    Args:
        objective: strictly convex.
        start: (3n,) first guess.
        reduction: stop already where the gradient has fallen to this share of what it was
            at the start.

    Returns:
        The minimiser (3n,), its gradient below 1e-7 of the objective's linear term.

    Raises:
        SolveTimeoutError: the time allowed is over.
        InputError: CG did not converge: the weights are too far apart.
    """
    size = len(start)
    gradient = objective.apply(start) + objective.linear
    step, code = cg(
        LinearOperator((size, size), matvec=objective.apply, dtype=np.float64),
        -gradient,
        rtol=reduction,
        atol=_TIGHT * float(np.linalg.norm(objective.linear)),
        maxiter=_ITERATION_LIMIT,
        M=preconditioner(objective.diagonal_blocks()),
        callback=lambda _: require_time(),
    )
    if code != 0:
        raise InputError(
            "the weights under 'surface' leave a program that cannot be solved to its digits: "
            "bring 'fairness', 'tangential', 'proximity' and 'reverse' closer together"
        )
    return np.asarray(start + step)


def preconditioner(blocks: VertexBlocks) -> LinearOperator:
    """Return the inverse of a block diagonal matrix as an operator on (3n,)."""
    inverse = np.ascontiguousarray(blocks.inverse().entries)
    size = 3 * len(inverse)

    def apply(x: Floats) -> Floats:
        result = np.empty((len(inverse), 3))
        multiply_blocks(inverse, x.reshape(-1, 3), result)
        return result.ravel()

    return LinearOperator((size, size), matvec=apply, dtype=np.float64)
