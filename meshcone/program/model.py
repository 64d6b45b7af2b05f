"""The paper's program as it was written: a CVXPY model.

Kept as the independent statement of the program the reduced form is tested against,
and offered as ``centroid.form = "cvxpy"``.
"""

from __future__ import annotations

import contextlib
import io
import tempfile
import time
from pathlib import Path

import cvxpy as cp
import numpy as np

from meshcone.deadline import seconds_left
from meshcone.options import SolverOptions
from meshcone.program.centroid import CentroidObjective
from meshcone.program.cones import EdgeCaps
from meshcone.program.diagnostics import ProgramSizes, RoundRecord
from meshcone.program.multipliers import Multipliers, active_cones
from meshcone.program.scs_solver import check_status, read_history, record_of
from meshcone.surface.arrays import Floats, normalized


def centroid_model(objective: CentroidObjective, caps: EdgeCaps) -> tuple[cp.Problem, cp.Variable]:
    """State the centroid program; the second value is its variable X, (n, 3)."""
    X = cp.Variable(objective.anchor.shape, name="X")
    centred = X - np.broadcast_to(objective.centroid, objective.anchor.shape)
    cost = cp.sum_squares(centred) + objective.regularization * cp.sum_squares(X - objective.anchor)
    lengths = cp.norm(X[caps.vertices[:, 0]] - X[caps.vertices[:, 1]], 2, axis=1)
    return cp.Problem(cp.Minimize(cost), [lengths <= caps.caps]), X


def compiled_sizes(problem: cp.Problem) -> ProgramSizes:
    """Compile a model for SCS and count, as the paper's table "SCS problem structure" does."""
    data, _, _ = problem.get_problem_data(cp.SCS)
    dims, A, P = data["dims"], data["A"], data["P"]
    return ProgramSizes(
        variables=A.shape[1],
        constraints=A.shape[0],
        zero=dims.zero,
        linear=dims.nonneg,
        second_order=sum(dims.soc),
        cones={EdgeCaps.kind: len(dims.soc)},
        nnz_A=A.nnz,
        nnz_P=P.nnz,
    )


def solve_centroid_model(
    objective: CentroidObjective, caps: EdgeCaps, options: SolverOptions, before: Floats
) -> tuple[Floats, tuple[Multipliers, ...], RoundRecord]:
    """Solve the model by CVXPY with SCS.

    Args:
        objective: the paper's objective.
        caps: the edges and their caps.
        options: tolerance, limits and the linear solver.
        before: (n, 3) positions the record's movement is counted from.

    Returns:
        The optimum X (n, 3), the multipliers of the edge cones and the record of the solve.

    Raises:
        InfeasibleError, SolveTimeoutError, InternalError: as :func:`scs_solver.solve`.
    """
    started = time.perf_counter()
    problem, X = centroid_model(objective, caps)
    with tempfile.TemporaryDirectory(prefix="meshcone-scs-") as directory:
        log = Path(directory) / "iterations.csv"
        with contextlib.redirect_stdout(io.StringIO()):
            problem.solve(
                solver=cp.SCS,
                eps_abs=options.tolerance,
                eps_rel=options.tolerance,
                max_iters=options.max_iterations,
                time_limit_secs=seconds_left() or options.time_limit,
                linear_solver=options.linear_solver,
                log_csv_filename=str(log),
            )
        history = read_history(log)
    info = problem.solver_stats.extra_stats["info"]
    check_status(info, options)
    optimum = np.asarray(X.value)
    strengths = np.asarray(problem.constraints[0].dual_value).ravel()
    multipliers = _cone_multipliers(caps, optimum, strengths)
    moves = np.sum((optimum - before) ** 2, axis=1)
    record = RoundRecord(
        round=1,
        method="scs",
        passes=1,
        seconds=time.perf_counter() - started,
        sizes=compiled_sizes(problem),
        info=record_of(info, constant=0.0),
        active_cones=active_cones([caps], multipliers),
        largest_violation=float(caps.violation(optimum).max(initial=0)),
        movement=float(np.sqrt(moves.mean())),
        history=history,
    )
    return optimum, multipliers, record


def _cone_multipliers(
    caps: EdgeCaps, optimum: Floats, strengths: Floats
) -> tuple[Multipliers, ...]:
    """Turn the multipliers of ‖u‖ ≤ δ, (k,), into those of the cones (δ, u)."""
    which = np.flatnonzero(strengths > 1e-9 * max(float(strengths.max(initial=0.0)), 1.0))
    if not len(which):
        return ()
    directions = normalized(caps.slack(optimum)[which, 1:])
    tips = strengths[which, None]
    return (Multipliers(caps, which, np.concatenate([tips, -tips * directions], axis=1)),)
