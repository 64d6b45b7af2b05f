"""A dual method on the active cones: augmented Lagrangian with Newton steps inside.

For minimise ½ xᵀP x + cᵀx subject to b − A x ∈ K, the method of multipliers with
penalty ρ minimises in x the smooth convex

    φ(x) = ½ xᵀP x + cᵀx + ‖Π_{K*}(y + ρ(A x − b))‖² / 2ρ

by semismooth Newton steps on (P + ρ AᵀV A) d = −∇φ, then sets y to the projection. With
few cones this needs a handful of linear solves, where an operator-splitting method
needs hundreds of iterations; its answers carry multipliers and complementarity by
construction, and are judged by the certificate like any other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import LinearOperator, cg

from meshcone.deadline import require_time
from meshcone.program.conic import Constraints
from meshcone.program.projection import project_dual, projection_derivative
from meshcone.program.relaxation import PreconditionedObjective, preconditioner
from meshcone.program.scs_solver import PrimalDual
from meshcone.program.vertex_blocks import CongruenceBlocks
from meshcone.program.work import Allowance
from meshcone.surface.arrays import Floats

_OUTER_LIMIT = 40
_NEWTON_LIMIT = 30
_CG_LIMIT = 400
_FIRST_PENALTY = 3.0  # in units of the mean diagonal of P
_PENALTY_GROWTH = 2.5
_LARGEST_PENALTY = 1e6
_LOOSEST_INNER_TOLERANCE = 1e-3
_INNER_TOLERANCE_FACTOR = 0.1
_FORCING = 0.2  # CG stops at this share of the gradient: early steps need no better
# A step may end where φ rises by this share of the slope it began to fall with, or where
# it still falls by that one.
_OVERSHOOT, _UNDERSHOOT = 0.1, 0.5
_LINE_SEARCH_LIMIT = 20
_STALL_WINDOW = 4


@dataclass(frozen=True)
class DualRun:
    """The end of a run.

    Attributes:
        solution: the last point, multipliers and slacks.
        converged: whether both residuals met the tolerance.
        multiplier_steps: outer iterations.
    """

    solution: PrimalDual
    converged: bool
    multiplier_steps: int


def solve_by_multipliers(
    objective: PreconditionedObjective,
    constraints: Constraints,
    start: Floats,
    multipliers: Floats,
    tolerance: float,
    allowance: Allowance,
) -> DualRun:
    """Solve a program from a first guess.

    Args:
        objective: strictly convex.
        constraints: the cones.
        start: (3n,) first x.
        multipliers: (m,) first y.
        tolerance: on the primal residual in the program's unit of length, and on the dual
            residual relative to the largest of ‖P x‖, ‖c‖, ‖Aᵀy‖, all in the ∞-norm.
        allowance: what it may take: a program on which the method is slow, because most of
            a mesh's cones bind, is better left to another.
    """
    state = _State(objective, constraints, start, multipliers, allowance)
    penalty = _FIRST_PENALTY * state.blocks.mean_diagonal()
    ceiling = _LARGEST_PENALTY * penalty
    primal = np.inf
    residuals: list[float] = []
    inner_tolerance = _LOOSEST_INNER_TOLERANCE
    for outer in range(1, _OUTER_LIMIT + 1):
        state.minimise(penalty, max(inner_tolerance, 0.3 * tolerance))
        inner_tolerance *= _INNER_TOLERANCE_FACTOR
        previous, primal = primal, state.step_multipliers(penalty)
        residuals.append(primal)
        if primal <= tolerance and state.dual_residual() <= tolerance:
            return DualRun(state.solution(), True, outer)
        if allowance.is_spent or _stalled(residuals):
            return DualRun(state.solution(), False, outer)
        if primal > 0.25 * previous:
            penalty = min(penalty * _PENALTY_GROWTH, ceiling)
    return DualRun(state.solution(), False, _OUTER_LIMIT)


def _stalled(residuals: list[float]) -> bool:
    """Tell a contradiction from slow progress: violations that no penalty reduces."""
    recent = residuals[-_STALL_WINDOW:]
    return len(residuals) > 2 * _STALL_WINDOW and min(recent) > 0.9 * max(recent)


class _State:
    """x, y and the products of them that every step needs."""

    def __init__(
        self,
        objective: PreconditionedObjective,
        constraints: Constraints,
        x: Floats,
        y: Floats,
        allowance: Allowance,
    ) -> None:
        self.x, self.y, self._allowance = x, y, allowance
        self.slack = np.zeros_like(y)
        self.blocks = objective.diagonal_blocks()
        self._product, self._c = objective.product(), objective.linear
        self._A, self._b = constraints.A.tocsr(), constraints.b
        self._At = sparse.csr_array(constraints.A.T)
        self._cones = constraints.selections
        pattern = projection_derivative(np.zeros_like(y), self._cones)
        self._curved_blocks = CongruenceBlocks(self._A, pattern)

    def solution(self) -> PrimalDual:
        return PrimalDual(self.x, self.y, self.slack)

    def minimise(self, penalty: float, tolerance: float) -> None:
        """Minimise φ for the present y, as far as the allowance goes."""
        for _ in range(_NEWTON_LIMIT):
            require_time()
            shifted = self._shifted(penalty)
            projected = project_dual(shifted, self._cones)
            smooth, pull, scale = self._gradient(projected)
            gradient = smooth + pull
            if _largest(gradient) <= tolerance * scale or self._allowance.is_spent:
                return
            direction = self._newton_direction(shifted, gradient, penalty)
            length = self._step_length(direction, shifted, smooth, penalty)
            if length == 0:
                return
            self.x = self.x + length * direction

    def step_multipliers(self, penalty: float) -> float:
        """Set y to the projection; return the primal residual ‖A x + s − b‖∞."""
        shifted = self._shifted(penalty)
        y = project_dual(shifted, self._cones)
        self.slack = (y - shifted) / penalty
        residual = _largest(y - self.y) / penalty
        self.y = y
        return residual

    def dual_residual(self) -> float:
        """Return ‖P x + c + Aᵀy‖∞ relative to the largest of its terms."""
        smooth, pull, scale = self._gradient(self.y)
        return _largest(smooth + pull) / scale

    def _shifted(self, penalty: float) -> Floats:
        return np.asarray(self.y + penalty * (self._A @ self.x - self._b))

    def _gradient(self, y: Floats) -> tuple[Floats, Floats, float]:
        """Return P x + c, Aᵀy, and the largest entry of P x, c and Aᵀy."""
        Px, Aty = self._product(self.x), self._At @ y
        return Px + self._c, Aty, max(_largest(Px), _largest(self._c), _largest(Aty))

    def _newton_direction(self, shifted: Floats, gradient: Floats, penalty: float) -> Floats:
        derivative = penalty * projection_derivative(shifted, self._cones)
        size, allowance = len(self.x), self._allowance
        most = min(_CG_LIMIT, allowance.products)
        allowance.systems -= 1

        def hessian(d: Floats) -> Floats:
            require_time()
            allowance.products -= 1
            curved = self._At @ (derivative @ (self._A @ d))
            return np.asarray(self._product(d) + curved)

        direction, _ = cg(
            LinearOperator((size, size), matvec=hessian, dtype=np.float64),
            -gradient,
            rtol=_FORCING,
            maxiter=most,
            M=preconditioner(self.blocks + self._curved_blocks.of(derivative)),
        )
        return np.asarray(direction)

    def _step_length(
        self, direction: Floats, shifted: Floats, smooth: Floats, penalty: float
    ) -> float:
        """Find where φ stops falling along a direction, by its slope.

        Near the optimum the decrease of φ is below the rounding of φ itself; its slope,
        which grows with the step because φ is convex, still has its leading digits.

        Args:
            direction: (3n,) a direction in which φ falls.
            shifted: (m,) y + ρ(A x − b).
            smooth: (3n,) P x + c.
            penalty: ρ.
        """
        along = self._A @ direction
        curvature = float(direction @ self._product(direction))
        linear = float(direction @ smooth)

        def slope(length: float) -> float:
            projected = project_dual(shifted + penalty * length * along, self._cones)
            return linear + length * curvature + float(along @ projected)

        first = slope(0.0)
        shortest, longest, length = 0.0, 1.0, 1.0
        for _ in range(_LINE_SEARCH_LIMIT):
            here = slope(length)
            if here > -_OVERSHOOT * first:
                longest = length
            elif here < _UNDERSHOOT * first and length < 1:
                shortest = length
            else:
                return length
            length = (shortest + longest) / 2
        return shortest


def _largest(vector: Floats) -> float:
    return float(np.abs(vector).max(initial=0.0))
