"""Solving a cone program with SCS, keeping everything it says about the run."""

from __future__ import annotations

import contextlib
import io
import math
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import scs

from meshcone.deadline import require_time, seconds_left
from meshcone.errors import InfeasibleError, InternalError, SolveTimeoutError
from meshcone.options import SolverOptions
from meshcone.program.conic import ConicProgram
from meshcone.program.diagnostics import SolveRecord
from meshcone.program.infeasibility import ContradictionError, read_conflicts
from meshcone.surface.arrays import Floats

# What SCS logs per iteration in more than forty columns; these are the ones that say
# how the run went (SCS documentation, "Return information").
_HISTORY_COLUMNS = ("iter", "res_pri", "res_dual", "gap", "pobj", "dobj", "scale", "time")


# SCS's test is of each row, relative to the largest; the certificate's is of whole cones of
# four rows, and absolute.
_CERTIFIED_SHARE = 0.2

# Before it looks at a point SCS solves a linear system. If its steps are kept short that takes a
# third of the time, and scaling the matrices does not pay for itself.
_ASKING: dict[str, Any] = {"max_iters": 1, "normalize": False, "rho_x": 100.0}

INFEASIBLE_STATUSES = (scs.INFEASIBLE, scs.INFEASIBLE_INACCURATE)


@dataclass(frozen=True)
class PrimalDual:
    """A point of the program and its multipliers.

    Attributes:
        x: (3n,) positions.
        y: (m,) dual variables, one a row of A.
        s: (m,) slacks.
    """

    x: Floats
    y: Floats
    s: Floats


@dataclass(frozen=True)
class ScsRun:
    """A finished solve."""

    solution: PrimalDual
    info: SolveRecord
    history: dict[str, list[float]]


def certifiable(options: SolverOptions) -> SolverOptions:
    """Tighten the tolerance so that SCS's answer passes the certificate's test at the caller's."""
    return options.model_copy(update={"tolerance": _CERTIFIED_SHARE * options.tolerance})


def solve(
    program: ConicProgram,
    options: SolverOptions,
    warm_start: PrimalDual | None = None,
    *,
    infeasibility_tolerance: float = 1e-7,
) -> ScsRun:
    """Solve a program with SCS.

    A run that ends at its iteration limit is returned with ``info.solved`` false: it is
    the caller's to say so.

    Args:
        program: at least one cone.
        options: tolerance, limits and the linear solver.
        warm_start: where to start from; all of x, y and s must match the program.
        infeasibility_tolerance: largest ‖Aᵀy‖∞ of a certificate of infeasibility with
            bᵀy = −1; the default is the paper's.

    Raises:
        ContradictionError: the constraints contradict each other; it says which.
        SolveTimeoutError: the time limit passed before the tolerance was met.
        InternalError: SCS could not work on the program at all.
    """
    result, history = _logged(program, options, warm_start, eps_infeas=infeasibility_tolerance)
    info = result["info"]
    if info["status_val"] in INFEASIBLE_STATUSES:
        raise ContradictionError(read_conflicts(program, np.asarray(result["y"])))
    check_status(info, options)
    return _run(program, result, history)


def agreement(program: ConicProgram, options: SolverOptions, point: PrimalDual) -> ScsRun | None:
    """Ask SCS whether its own test of termination holds at a point.

    It is the test of every run, with the caller's tolerance.

    Returns:
        None where it does not hold, or the time limit passed first.
    """
    result, history = _logged(program, options, point, **_ASKING)
    solved = result["info"]["status_val"] == scs.SOLVED
    return _run(program, result, history) if solved else None


def _run(program: ConicProgram, result: dict[str, Any], history: dict[str, list[float]]) -> ScsRun:
    return ScsRun(
        solution=PrimalDual(np.asarray(result["x"]), np.asarray(result["y"]), result["s"]),
        info=record_of(result["info"], program.constant),
        history=history,
    )


def record_of(info: dict[str, Any], constant: float) -> SolveRecord:
    """Turn SCS's return information into a record.

    Args:
        info: the ``info`` of a finished run.
        constant: added to both objectives.
    """
    return SolveRecord(
        status=str(info["status"]),
        solved=info["status_val"] == scs.SOLVED,
        iterations=int(info["iter"]),
        primal_residual=float(info["res_pri"]),
        dual_residual=float(info["res_dual"]),
        gap=float(info["gap"]),
        primal_objective=float(info["pobj"]) + constant,
        dual_objective=float(info["dobj"]) + constant,
        linear_solver=str(info["lin_sys_solver"]),
        setup_seconds=float(info["setup_time"]) / 1e3,
        solve_seconds=float(info["solve_time"]) / 1e3,
    )


def _logged(
    program: ConicProgram, options: SolverOptions, start: PrimalDual | None, **settings: Any
) -> tuple[dict[str, Any], dict[str, list[float]]]:
    """Run SCS with settings of its own besides ours; what it returns, and what it logged."""
    with tempfile.TemporaryDirectory(prefix="meshcone-scs-") as directory:
        log = Path(directory) / "iterations.csv"
        ours = {
            "linear_solver": scs.LinearSolver(options.linear_solver),
            "eps_abs": options.tolerance,
            "eps_rel": options.tolerance,
            "max_iters": options.max_iterations,
            "time_limit_secs": seconds_left() or options.time_limit,
            "log_csv_filename": str(log),
            "verbose": False,
        }
        data = {"P": program.P, "A": program.A, "b": program.b, "c": program.c}
        # SCS announces its log file on sys.stdout whatever `verbose` says.
        with contextlib.redirect_stdout(io.StringIO()):
            solver = scs.SCS(data, program.cones, **(ours | settings))
            require_time()  # its setup, which factorizes, cannot be interrupted
            known = {} if start is None else vars(start)
            result = solver.solve(warm_start=start is not None, **known)
        return result, read_history(log)


def check_status(info: dict[str, Any], options: SolverOptions) -> None:
    """Raise what an unsuccessful run means; a run that only ran out of iterations passes.

    Raises:
        InfeasibleError: no point satisfies the constraints.
        SolveTimeoutError: the time limit was reached.
        InternalError: any other failure.
    """
    status = info["status_val"]
    if status in INFEASIBLE_STATUSES:
        raise InfeasibleError("the requested constraints contradict each other")
    if status == scs.SOLVED_INACCURATE and "time_limit" in str(info["status"]):
        raise SolveTimeoutError(f"the solver did not finish within {options.time_limit:g} s")
    if status not in (scs.SOLVED, scs.SOLVED_INACCURATE):
        raise InternalError(f"the solver gave up: {info['status']}")


def read_history(log: Path) -> dict[str, list[float]]:
    """Read the columns worth keeping from SCS's iteration log.

    SCS goes on where it cannot write. On a full disk the log is not there, ends amid a row, or
    has such rows in it: they are left out, as what they were to say is not known.
    """
    text = log.read_text(encoding="ascii", errors="replace") if log.exists() else ""
    head, *rows = [line.split(",") for line in text.split("\n")[:-1]] or [[]]
    if not set(_HISTORY_COLUMNS) <= set(head):
        rows = []
    # The head has more columns than a row. What a cut row has before the next is longer than one.
    width = min(map(len, rows), default=0)
    whole = [dict(zip(head, row, strict=False)) for row in rows if len(row) == width]
    return {name: [_finite(row[name]) for row in whole] for name in _HISTORY_COLUMNS}


def _finite(text: str) -> float:
    """Read a logged number; SCS logs nan and inf before it has an estimate, JSON has neither."""
    value = float(text)
    return value if math.isfinite(value) else math.copysign(1e300, value)
