"""What a job that succeeded adds to the ledger's counters, which /metrics reads.

A histogram is kept as one counter a bucket, beside a sum and a count: ``NAME:le:BOUND``,
``NAME:sum``, ``NAME:count``. A bucket holds what falls into it alone; whoever shows it adds
up those below, as Prometheus wants them.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from meshcone.report.report import AnyReport

SECONDS: Sequence[float] = (0.01, 0.03, 0.1, 0.3, 1, 3, 10, 30, 100, 300, 1000, math.inf)
ITERATIONS: Sequence[float] = (0, 10, 30, 100, 300, 1000, 3000, 10_000, math.inf)
STAGES = ("read", "align", "solve", "quality", "write", "audit")

STAGE_SECONDS = "stage_seconds"
SOLVER_ITERATIONS = "solver_iterations"
ROUNDS = "rounds"


@dataclass(frozen=True)
class Tallies:
    """What the ledger keeps of how the work went.

    Attributes:
        timings: seconds of each stage, for the job's record.
        counters: amounts to add to the ledger's counters.
    """

    timings: Mapping[str, float]
    counters: Mapping[str, float]


def tallies_of(report: AnyReport) -> Tallies:
    """Read them from a report; only a refinement has rounds."""
    timings = {name: float(getattr(report.timings, name)) for name in (*STAGES, "total")}
    counters: Counter[str] = Counter()
    for stage in STAGES:
        counters.update(_observed(f"{STAGE_SECONDS}:{stage}", timings[stage], SECONDS))
    solver = getattr(report, "solver", None)
    for record in () if solver is None else solver.rounds:
        counters[f"{ROUNDS}:{record.method}"] += 1
        if record.info is not None:
            counters.update(_observed(SOLVER_ITERATIONS, record.info.iterations, ITERATIONS))
    return Tallies(timings, dict(counters))


def bucket(name: str, bound: float) -> str:
    """The counter of a histogram's bucket."""
    return f"{name}:le:{bound:g}"


def _observed(name: str, value: float, bounds: Sequence[float]) -> Mapping[str, float]:
    found = bounds[bisect_left(bounds, value)]
    return {bucket(name, found): 1, f"{name}:sum": value, f"{name}:count": 1}
