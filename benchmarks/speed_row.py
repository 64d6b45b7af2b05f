"""One measurement of time and memory, in a process of its own.

    python benchmarks/speed_row.py CASE

CASE is the JSON of a :class:`Case`; one line of JSON is printed. The number of threads is
set by whoever starts the process, in its environment and its processor affinity.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

import numpy as np
from conic_peers import CONIC_PEERS
from measures import Yardstick
from methods import PEERS, Pair, SkippedError
from reference_shapes import bumpy_torus, framed

from meshcone.options import Options, parse_options
from meshcone.program.answer import RefinedPositions
from meshcone.program.conic import assemble, everything
from meshcone.program.round_solver import solve_round
from meshcone.program.rounds import refine_surface
from meshcone.program.surface_objective import SurfaceObjective
from meshcone.surface import Mesh, SurfaceTree
from meshcone.surface.arrays import Floats

ENGINE, PROGRAM = "engine", "engine, last round"
_SEARCH_STEPS, _SHARE_TOLERANCE = 4, 0.02
_REPEATED_BELOW, _FEW, _MANY = 20_000, 3, 15
_ENOUGH_SECONDS = 30.0
_WARM_UP_VERTICES = 200

Constraint = Literal["none", "displacement", "edges"]


@dataclass(frozen=True)
class Case:
    """What to measure.

    Attributes:
        method: :data:`ENGINE`, a peer of it, :data:`PROGRAM` or a peer of that.
        vertices: about how many; the shape is a bumpy torus, its own reference.
        noise: standard deviation on every coordinate, in mean edge lengths.
        constraint: the cones asked for, besides those that are always there.
        active: share of those cones that should be active at the optimum.
        radius_noise: the deviation in radii instead, where it is not 0.
    """

    method: str
    vertices: int
    effort: Literal["fast", "best"] = "fast"
    certify: bool = False
    constraint: Constraint = "none"
    active: float = 0.1
    noise: float = 0.3
    radius_noise: float = 0.0

    def options(self, cap: float | None) -> Options:
        """The engine's options, with the cap on what is constrained."""
        cones: dict[str, Any] = {
            "none": {},
            "displacement": {"max_displacement": {"relative": cap}},
            "edges": {"edge_cap": {"times_input": cap}},
        }[self.constraint]
        solver = {"certify": self.certify}
        return parse_options({"effort": self.effort, "solver": solver, "cones": cones})


def measure(case: Case) -> dict[str, Any]:
    """Run a case and say what it took and how good the result is."""
    pair = make_pair(case)
    refine_surface(*_small_pair(), case.options(1.0))
    cap, share = find_cap(case, pair)
    run = prepare(case, pair, cap)
    before = peak_mebibytes()
    try:
        seconds, processor, positions = timed(run, len(pair.source.vertices))
    except SkippedError as error:
        return {"trouble": str(error)}
    peak = peak_mebibytes()
    yardstick = Yardstick(pair.reference)
    after = yardstick.measure(pair.source.moved_to(positions))
    first = yardstick.measure(pair.source)
    return {
        "vertices": len(pair.source.vertices),
        "seconds": seconds,
        "processor_seconds": processor,
        "peak_mebibytes": peak,
        "peak_before_mebibytes": before,
        "active_share": share,
        "ratio": after.point_to_surface / first.point_to_surface,
        "normals": after.normals,
        **_optimality(case, pair, cap, positions),
    }


def make_pair(case: Case) -> Pair:
    """A bumpy torus with seeded noise, and itself without."""
    reference = framed(bumpy_torus(case.vertices))
    deviation = case.radius_noise or case.noise * float(reference.edge_lengths.mean())
    noise = np.random.default_rng(1).normal(size=reference.vertices.shape)
    source = Mesh(reference.vertices + deviation * noise, reference.faces)
    return Pair(source, reference, SurfaceTree(reference))


def find_cap(case: Case, pair: Pair) -> tuple[float | None, float]:
    """Find the cap that leaves about the asked share of cones active, and that share."""
    if case.constraint == "none":
        return None, 0.0
    free = replace(case, constraint="none", certify=False)
    loose = refine_surface(pair.source, pair.reference, free.options(None))
    sizes = _constrained_sizes(case.constraint, pair.source, loose.positions)
    level, cap, share = 1 - case.active, 0.0, 0.0
    for _ in range(_SEARCH_STEPS):
        cap = float(np.quantile(sizes, level))
        options = replace(case, certify=False).options(cap)
        refined = refine_surface(pair.source, pair.reference, options)
        share = active_cones(refined) / len(sizes)
        if abs(share - case.active) < _SHARE_TOLERANCE:
            break
        level = min(max(level + share - case.active, 0.02), 0.999)
    return cap, share


def active_cones(refined: RefinedPositions) -> int:
    """Cones with a multiplier at the last round's optimum."""
    return sum(refined.rounds[-1].active_cones.values())


def prepare(case: Case, pair: Pair, cap: float | None) -> Callable[[], Floats]:
    """Build what is to be timed; what it returns are the positions (n, 3)."""
    options = case.options(cap)
    if case.method == ENGINE:
        return lambda: refine_surface(pair.source, pair.reference, options).positions
    if case.method in PEERS:
        return lambda: PEERS[case.method](pair)
    final = refine_surface(pair.source, pair.reference, options).final
    assert final is not None
    objective, families, start = final.objective, final.families, final.before
    assert isinstance(objective, SurfaceObjective)
    if case.method == PROGRAM:
        return lambda: solve_round(objective, families, start, options.solver).positions
    solve = CONIC_PEERS[case.method]
    return lambda: solve(assemble(objective, everything(families))).reshape(-1, 3)


def timed(run: Callable[[], Floats], vertices: int) -> tuple[float, float, Floats]:
    """Seconds of wall clock and of all threads in the fastest of several runs, and the result.

    What else a shared machine does only ever adds to a run's time.
    """
    repeats = _MANY if vertices < _REPEATED_BELOW else _FEW
    taken: list[tuple[float, float]] = []
    positions = np.zeros((0, 3))
    while len(taken) < repeats and sum(wall for wall, _ in taken) < _ENOUGH_SECONDS:
        wall, processor = time.perf_counter(), processor_seconds()
        positions = run()
        taken.append((time.perf_counter() - wall, processor_seconds() - processor))
    return *min(taken), positions


def processor_seconds() -> float:
    """Processor time of this process so far, and of those it has started and waited for."""
    used = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(each.ru_utime + each.ru_stime for each in used)


def peak_mebibytes(*, of_children: bool = False) -> float:
    """The largest resident set of this process so far, or of those it has waited for."""
    who = resource.RUSAGE_CHILDREN if of_children else resource.RUSAGE_SELF
    peak = resource.getrusage(who).ru_maxrss
    return peak / (1 << 20 if sys.platform == "darwin" else 1 << 10)


def _constrained_sizes(constraint: Constraint, source: Mesh, positions: Floats) -> Floats:
    """What the caps cap, where nothing is capped."""
    if constraint == "displacement":
        return np.asarray(np.linalg.norm(positions - source.vertices, axis=1))
    after, before = source.moved_to(positions).edge_lengths, source.edge_lengths
    return after / np.maximum(before, 1e-300)


def _optimality(case: Case, pair: Pair, cap: float | None, positions: Floats) -> dict[str, float]:
    """The objective and the largest violation of the last round's program, at positions."""
    if case.method == ENGINE or case.method in PEERS:
        return {}
    final = refine_surface(pair.source, pair.reference, case.options(cap)).final
    assert final is not None
    x = positions.ravel()
    value = x @ final.objective.apply(x) / 2 + final.objective.linear @ x
    violations = [family.violation(positions).max(initial=0.0) for family in final.families]
    return {
        "objective": float(value + final.objective.constant),
        "violation": float(max(violations)),
    }


def _small_pair() -> tuple[Mesh, Mesh]:
    small = make_pair(Case(ENGINE, _WARM_UP_VERTICES))
    return small.source, small.reference


if __name__ == "__main__":
    chosen = Case(**json.loads(sys.argv[1]))
    print(json.dumps({**asdict(chosen), **measure(chosen)}))
