"""Solving one round's convex program: the relaxation, then only the cones it violates.

A program's optimum is also the optimum of the program with only its active cones. So
the relaxation is solved first; if it violates nothing it is the optimum. Otherwise the
violated cones are added and the program solved again, until no cone is violated.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from meshcone.errors import InternalError
from meshcone.options import SolverOptions
from meshcone.program.augmented import solve_by_multipliers
from meshcone.program.cones import FEASIBILITY, ConeFamily
from meshcone.program.conic import (
    ConicProgram,
    QuadraticObjective,
    Selection,
    assemble,
    everything,
    write_constraints,
)
from meshcone.program.multipliers import Multipliers, flatten, unflatten
from meshcone.program.relaxation import PreconditionedObjective, solve_relaxation
from meshcone.program.scs_solver import PrimalDual, ScsRun, certifiable, solve
from meshcone.program.work import Allowance
from meshcone.surface.arrays import Floats, Ints

Method = Literal["relaxation", "multipliers", "scs"]
# Puts what depends on the rest of (n, 3) positions exactly where it belongs.
Settled = Callable[[Floats], Floats]

_PASS_LIMIT = 20
# Tolerance of the dual method in units of SCS's, in the last round and in those before.
_TIGHT, _LOOSE = 1e-2, 100.0
# Linear systems it may solve and products it may take for that, over all selections of a round;
# a round that only prepares the next one is worth fewer.
_TIGHT_WORK, _LOOSE_WORK = (200, 20_000), (40, 4_000)
# Cones this close to their bound join the first selection: they are next to be violated.
_NEARLY_TIGHT = 0.02


@dataclass(frozen=True)
class RoundSolution:
    """An optimum of a round's program.

    Attributes:
        positions: (n, 3).
        multipliers: one entry per family that has any.
        method: what found it.
        passes: selections of cones it took.
        program: what SCS solved, where it was SCS.
        run: its run.
        converged: whether the dual method reached its tolerance; if not, this is where it
            stood when its budget was spent, and :func:`finish_by_scs` goes on from there.
    """

    positions: Floats
    multipliers: tuple[Multipliers, ...]
    method: Method
    passes: int
    program: ConicProgram | None = None
    run: ScsRun | None = None
    converged: bool = True


def solve_round(
    objective: PreconditionedObjective,
    families: Sequence[ConeFamily],
    start: Floats,
    options: SolverOptions,
    reduction: float = 0.0,
    known: Sequence[Multipliers] = (),
    settled: Settled | None = None,
    *,
    allowance: Allowance | None = None,
) -> RoundSolution:
    """Solve a round's program to optimality.

    Args:
        objective: strictly convex.
        families: every constraint.
        start: (n, 3) first guess.
        options: method, tolerance and limits.
        reduction: how far CG need reduce the gradient of the relaxation; 0 for all the way.
            A round of which that is enough is also solved less tightly over its cones.
        known: multipliers of the round before: most of its active cones will be again.
        settled: what to do with the relaxation's optimum, which CG finds only nearly, where that
            is known to bring it nearer.
        allowance: what the dual method may take, if less than usual.

    Raises:
        InfeasibleError: the constraints contradict each other.
        SolveTimeoutError: the time limit passed.
        InternalError: neither method found an optimum.
    """
    relaxed = solve_relaxation(objective, start.ravel(), reduction)
    if settled is not None:
        relaxed = settled(relaxed.reshape(-1, 3)).ravel()
    if options.method == "full":
        program = assemble(objective, everything(families))
        run = solve(program, certifiable(options), slack_start(program, relaxed))
        return _by_scs(program, run, passes=1)
    if not any(_exceeded(family, relaxed) for family in families):
        return RoundSolution(relaxed.reshape(-1, 3), (), "relaxation", 0)
    loose = reduction > 0
    if allowance is None:
        allowance = Allowance(*(_LOOSE_WORK if loose else _TIGHT_WORK))
    return _solve_active(objective, families, relaxed, options, tuple(known), loose, allowance)


def _solve_active(
    objective: PreconditionedObjective,
    families: Sequence[ConeFamily],
    x: Floats,
    options: SolverOptions,
    known: tuple[Multipliers, ...],
    loose: bool,
    allowance: Allowance,
) -> RoundSolution:
    tolerance = (_LOOSE if loose else _TIGHT) * options.tolerance
    active = {entry.family.kind: entry.which for entry in known}
    nowhere = np.empty(0, dtype=np.int64)
    chosen = [
        np.union1d(_violated(family, x, _NEARLY_TIGHT), active.get(family.kind, nowhere))
        for family in families
    ]
    for passes in range(1, _PASS_LIMIT + 1):
        pairs = zip(families, chosen, strict=True)
        selected = [Selection(family, which) for family, which in pairs]
        constraints = write_constraints(selected, len(x))
        start = flatten(known, constraints.selections)
        dual = solve_by_multipliers(objective, constraints, x, start, tolerance, allowance)
        found = unflatten(dual.solution.y, constraints.selections, objective.linear)
        positions = dual.solution.x.reshape(-1, 3)
        solution = RoundSolution(positions, found, "multipliers", passes)
        if not dual.converged:
            return replace(solution, converged=False)
        if loose:  # what it leaves violated the next round's selection begins with
            return solution
        x, known = solution.positions.ravel(), solution.multipliers
        fresh = [_violated(family, x, -10 * tolerance) for family in families]
        grown = [np.union1d(old, new) for old, new in zip(chosen, fresh, strict=True)]
        if all(len(new) == len(old) for new, old in zip(grown, chosen, strict=True)):
            return solution
        chosen = grown
    raise InternalError(f"cones kept being violated after {_PASS_LIMIT} selections")


def finish_by_scs(
    objective: QuadraticObjective,
    families: Sequence[ConeFamily],
    reached: RoundSolution,
    options: SolverOptions,
) -> RoundSolution:
    """Go on with SCS, over every cone, from where the dual method stood.

    Raises:
        ContradictionError, SolveTimeoutError, InternalError: see :func:`scs_solver.solve`.
    """
    program = assemble(objective, everything(families))
    x = reached.positions.ravel()
    y = flatten(reached.multipliers, program.selections)
    start = PrimalDual(x, y, program.b - program.A @ x)
    return _by_scs(program, solve(program, certifiable(options), start), reached.passes)


def _violated(family: ConeFamily, x: Floats, margin: float) -> Ints:
    """Choose the cones that are violated, or tight within a share of their bound."""
    positions = x.reshape(-1, 3)
    if family.cone == "zero":
        return np.arange(len(family))
    return np.flatnonzero(family.tightness(positions) > -margin)


def _exceeded(family: ConeFamily, x: Floats) -> bool:
    return float(family.violation(x.reshape(-1, 3)).max(initial=0.0)) > FEASIBILITY


def _by_scs(program: ConicProgram, run: ScsRun, passes: int) -> RoundSolution:
    found = unflatten(run.solution.y, program.selections, program.c)
    return RoundSolution(run.solution.x.reshape(-1, 3), found, "scs", passes, program, run)


def slack_start(program: ConicProgram, x: Floats) -> PrimalDual:
    """Start SCS at x (3n,) without multipliers."""
    return PrimalDual(x, np.zeros(len(program.b)), program.b - program.A @ x)
