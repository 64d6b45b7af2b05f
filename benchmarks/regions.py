"""A mesh refined region by region, beside the same mesh refined as a whole.

    python benchmarks/regions.py [--vertices 10000 40000] [--regions 1 4] [--processes 1 2]

A bumpy torus with noise of a third of an edge, its own reference, ``effort: fast`` and not
confirmed by SCS: the rounds alone, without files and metrics. Each row is a process of its own.
"shared" is what of the processor time was spent in the processes it forked; "peak" is what it
holds at most beyond what it held before it began; "child" is all that the largest of the forked
ones holds, most of it shared with the one it came from; "together" are products with the whole
program's matrix that finished the last round; "p2s" is the distance over that of the whole, and
"same" whether the positions are to the last bit those of the first row of as many regions.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import resource
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from threads import limit_threads, thread_environment

limit_threads(1)

from measures import Yardstick  # noqa: E402 - the libraries read how many threads they have
from rich.console import Console  # noqa: E402
from rich.table import Table  # noqa: E402
from speed_row import ENGINE, Case, make_pair, peak_mebibytes, processor_seconds  # noqa: E402

from meshcone.options import Options, parse_options  # noqa: E402
from meshcone.processes import processes_allowed  # noqa: E402
from meshcone.program.rounds import refine_surface  # noqa: E402

_SECONDS = 3600  # that a row may take
_WARM_UP = 400


def main(argv: Sequence[str] | None = None) -> int:
    """Measure every size, division and number of processes, one after the other."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--vertices", type=int, nargs="+", default=[10_000, 40_000])
    parser.add_argument("--regions", type=int, nargs="+", default=[1, 4])
    parser.add_argument("--processes", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--row", type=json.loads, help=argparse.SUPPRESS)
    arguments = parser.parse_args(argv)
    if arguments.row is not None:
        print(json.dumps(measured(**arguments.row)))
        return 0
    table = Table(title="one thread in each process; a bumpy torus with noise")
    for title in (
        "vertices",
        "regions",
        "processes",
        "s",
        "cpu s",
        "shared",
        "peak MiB",
        "child MiB",
    ):
        table.add_column(title, justify="right")
    for title in ("together", "p2s", "same"):
        table.add_column(title, justify="right")
    for vertices in arguments.vertices:
        rows = [
            in_a_process(vertices=vertices, regions=regions, processes=processes)
            for regions in arguments.regions
            for processes in arguments.processes
        ]
        for row in rows:
            table.add_row(*cells(row, rows))
    Console(width=None if sys.stdout.isatty() else 110).print(table)
    return 0


def in_a_process(**row: int) -> dict[str, Any]:
    """Measure a row in a process of its own.

    Raises:
        subprocess.CalledProcessError: it failed.
    """
    command = [sys.executable, str(Path(__file__)), "--row", json.dumps(row)]
    done = subprocess.run(
        command,
        env=thread_environment(1),
        stdout=subprocess.PIPE,
        text=True,
        timeout=_SECONDS,
        check=True,
    )
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return {**row, **found}


def measured(vertices: int, regions: int, processes: int) -> dict[str, Any]:
    """Refine once, and say what it took and how close the result is."""
    small, pair = (make_pair(Case(ENGINE, size)) for size in (_WARM_UP, vertices))
    refine_surface(small.source, small.reference, options(1))
    held = resident_mebibytes()
    wall, processor = time.perf_counter(), processor_seconds()
    with processes_allowed(processes):
        answer = refine_surface(pair.source, pair.reference, options(regions))
    wall, processor = time.perf_counter() - wall, processor_seconds() - processor
    peak, child = peak_mebibytes(), peak_mebibytes(of_children=True)
    after = Yardstick(pair.reference).measure(pair.source.moved_to(answer.positions))
    return {
        "found": len(pair.source.vertices),
        "seconds": wall,
        "processor_seconds": processor,
        "shared": children_seconds(),
        "peak": peak - held,
        "child": child if processes > 1 else None,
        "together": None if answer.regions is None else answer.regions.products_together,
        "distance": after.point_to_surface,
        "digest": hashlib.sha256(answer.positions.tobytes()).hexdigest(),
    }


def children_seconds() -> float:
    """Processor time of the processes that this one has started and waited for."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def options(regions: int) -> Options:
    """Fast, and not confirmed."""
    return parse_options(
        {"effort": "fast", "solver": {"certify": False}, "surface": {"regions": regions}}
    )


def resident_mebibytes() -> float:
    """What this process holds now; where that is not to be had, at most so far."""
    try:
        status = Path("/proc/self/status").read_text(encoding="ascii")
    except OSError:
        return peak_mebibytes()
    [line] = [line for line in status.splitlines() if line.startswith("VmRSS:")]
    return int(line.split()[1]) / 1024


def cells(row: dict[str, Any], rows: Sequence[dict[str, Any]]) -> list[str]:
    """A row of the table, beside the others of its size."""
    alike = [other for other in rows if other["regions"] == row["regions"]]
    whole = [other for other in rows if other["regions"] == 1]
    return [
        f"{row['found']:,}",
        str(row["regions"]),
        str(row["processes"]),
        f"{row['seconds']:.1f}",
        f"{row['processor_seconds']:.1f}",
        f"{row['shared']:.1f}",
        f"{row['peak']:.0f}",
        "-" if row["child"] is None else f"{row['child']:.0f}",
        "-" if row["together"] is None else str(row["together"]),
        f"{row['distance'] / whole[0]['distance']:.4f}" if whole else "-",
        "yes" if row["digest"] == alike[0]["digest"] else "no",
    ]


if __name__ == "__main__":
    sys.exit(main())
