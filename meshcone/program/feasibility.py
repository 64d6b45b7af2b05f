"""Asking first whether any mesh satisfies the constraints at all.

A contradiction makes every method that also minimises something run to its limits. With
no objective SCS finds a feasible point, or the proof that there is none, in a fraction
of the time of a round.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import sparse

from meshcone.options import SolverOptions
from meshcone.program.cones import ConeFamily
from meshcone.program.conic import assemble, everything
from meshcone.program.scs_solver import PrimalDual, solve
from meshcone.surface.arrays import Floats

_TOLERANCE = 1e-4
_ITERATIONS = 2000


class _NoObjective:
    def __init__(self, size: int) -> None:
        self.linear = np.zeros(size)
        self.constant = 0.0

    def matrix(self) -> sparse.csc_array:
        return sparse.csc_array((len(self.linear), len(self.linear)))

    def apply(self, x: Floats) -> Floats:
        return np.zeros_like(x)


def require_feasible(
    families: Sequence[ConeFamily], positions: Floats, options: SolverOptions
) -> None:
    """Check that some mesh satisfies every constraint.

    Nothing is solved where ``positions`` (n, 3) satisfy them already. A certificate y of
    infeasibility is believed where ‖Aᵀy‖∞ is so small that it excludes every point with
    coordinates up to 10 in the frame, in which the reference has radius 1.

    Raises:
        ContradictionError: no mesh does.
    """
    if not any(family.unmet(positions) for family in families):
        return
    x = positions.ravel()
    program = assemble(_NoObjective(len(x)), everything(families))
    settings = options.model_copy(
        update={"tolerance": _TOLERANCE, "max_iterations": _ITERATIONS, "linear_solver": "auto"}
    )
    start = PrimalDual(x, np.zeros(len(program.b)), program.b - program.A @ x)
    solve(program, settings, start, infeasibility_tolerance=1 / (10 * len(x)))
