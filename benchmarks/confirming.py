"""What it costs to have SCS confirm an optimum, by size and linear solver.

    python benchmarks/confirming.py [--subdivisions 4 5 6] [--limit 60]

Refines bumpy spheres of its own, writes the last round's program with every cone in it, and
starts SCS at the optimum. Each solver runs in a process of its own, so that a factorisation
that fills in can be ended. The last column is the number of iterations SCS took.
"""

from __future__ import annotations

import argparse
import multiprocessing
import time
from multiprocessing.connection import Connection

from threads import limit_threads

limit_threads(1)  # before the libraries below are loaded

from profile_engine import bumpy_sphere, noisy_copy  # noqa: E402
from rich.console import Console  # noqa: E402
from rich.table import Table  # noqa: E402

from meshcone.options import parse_options  # noqa: E402
from meshcone.program.answer import FinalProgram  # noqa: E402
from meshcone.program.conic import ConicProgram, assemble, everything  # noqa: E402
from meshcone.program.round_solver import slack_start  # noqa: E402
from meshcone.program.rounds import refine_surface  # noqa: E402
from meshcone.program.scs_solver import agreement, solve  # noqa: E402
from meshcone.surface.arrays import Floats  # noqa: E402

SOLVERS = ("cpu_indirect", "mkl", "qdldl")


def optimum(subdivisions: int) -> FinalProgram:
    """The last round's program of a noisy sphere on which no cone is active, and its optimum."""
    reference = bumpy_sphere(subdivisions)
    options = parse_options({"effort": "fast", "solver": {"certify": False}})
    final = refine_surface(noisy_copy(reference), reference, options).final
    assert final is not None
    return final


def confirm(program: ConicProgram, x: Floats, solver: str, sender: Connection) -> None:
    """Start SCS at the optimum; send the seconds it took and its iterations."""
    options = parse_options({"solver": {"linear_solver": solver}}).solver
    started = time.perf_counter()
    point = slack_start(program, x)
    run = agreement(program, options, point) or solve(program, options, point)
    sender.send((time.perf_counter() - started, run.info.iterations))


def timed(program: ConicProgram, x: Floats, solver: str, limit: float) -> tuple[str, str]:
    """Run :func:`confirm` in a process, at most for ``limit`` seconds."""
    context = multiprocessing.get_context("fork")
    receiver, sender = context.Pipe(duplex=False)
    child = context.Process(target=confirm, args=(program, x, solver, sender))
    child.start()
    sender.close()
    try:
        if not receiver.poll(limit):
            return f"over {limit:g}", "-"
        seconds, iterations = receiver.recv()
        return f"{seconds:.2f}", str(iterations)
    except EOFError:
        return "not to be had", "-"
    finally:
        child.kill()
        child.join()


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--subdivisions", type=int, nargs="+", default=[4, 5, 6])
    parser.add_argument("--limit", type=float, default=60.0, help="seconds for each solver")
    arguments = parser.parse_args()
    table = Table(title="confirming an optimum")
    for title in ("vertices", "writing P and A, s", "solver", "s", "iterations"):
        table.add_column(title, justify="right")
    for subdivisions in arguments.subdivisions:
        final = optimum(subdivisions)
        started = time.perf_counter()
        program = assemble(final.objective, everything(final.families))
        writing = time.perf_counter() - started
        for solver in SOLVERS:
            x = final.positions.ravel()
            result = timed(program, x, solver, arguments.limit)
            table.add_row(f"{len(final.positions):,}", f"{writing:.2f}", solver, *result)
    Console().print(table)


if __name__ == "__main__":
    main()
