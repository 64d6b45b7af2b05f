"""The engine on degraded shapes beside its peers, and how long it takes at which size.

    python benchmarks/engine.py [--data DIR] [--set small|all] [--effort fast,best] [--json FILE]
    python benchmarks/engine.py --speed [--json FILE]

All 59 shapes six times, `--set all --effort best --peers "" --jobs 2`, are to take less than 45
minutes on two processors that nobody else uses; `--minutes 45` sees to it.

Without --data it makes a few shapes; with it, it reads those of DIR/objects and DIR/scans.
Each is degraded in several seeded ways and refined against the original by every method.

Columns: point-to-surface distance refined over input (median, 90th percentile, worst);
"normals", the median over shapes of the consistency with the closest triangle; "aspect",
the largest median aspect ratio over the input's; "excess", the same over the larger of the
input's and the reference's own; "flips", faces turned against the reference (see flips.py)
and on how many shapes; "crossings", pairs of faces that pass through each other and did not
before; "worse", shapes farther from the reference than their input; "harmed", shapes worse than
their input by the rule the engine itself follows; "beaten", shapes where a peer is nearer and has
better normals, both; "s", median seconds. The row "wanted" has what the engine is to stay below on
those 59.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import sys
import time
from collections.abc import Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from pathlib import Path
from typing import Any

from threads import limit_threads

limit_threads(1)  # before the libraries below are loaded, here and in the pool's processes

import numpy as np  # noqa: E402
from comparison import Row, compare_methods  # noqa: E402
from degradations import DEGRADATIONS, missing_library  # noqa: E402
from methods import BOUNDS, PEERS, engine_methods  # noqa: E402
from reference_shapes import Shape, made_shapes, stored_shapes  # noqa: E402
from rich.console import Console  # noqa: E402
from speed import print_speed, run_speed  # noqa: E402
from summary import as_record, print_summaries, print_totals, summarise  # noqa: E402


def chosen_shapes(arguments: argparse.Namespace) -> list[Shape]:
    """The shapes the arguments ask for."""
    if arguments.data is None:
        shapes = made_shapes(arguments.vertices)
    else:
        shapes = stored_shapes(arguments.data, small=arguments.set == "small")
    return [shape for shape in shapes if arguments.only in shape.name]


def run_pair(shape: str, degradation: str, arguments: argparse.Namespace) -> list[Row]:
    """Every method on one degraded shape, in a process of the pool."""
    (chosen,) = (s for s in chosen_shapes(arguments) if s.name == shape)
    methods = engine_methods(arguments.effort) | {
        name: (PEERS | BOUNDS)[name] for name in arguments.peers
    }
    return compare_methods(chosen, degradation, methods, arguments.cache)


def run_comparison(arguments: argparse.Namespace) -> tuple[list[Row], dict[str, str]]:
    """All pairs; the second value says of pairs without rows what went wrong."""
    names = [shape.name for shape in chosen_shapes(arguments)]
    pairs = [(name, degradation) for degradation in arguments.degradations for name in names]
    rows: dict[tuple[str, str], list[Row]] = {}
    broken: dict[str, str] = {}
    context = multiprocessing.get_context("spawn")
    ends = time.monotonic() + 60 * arguments.minutes
    # By shape, so that a run which is cut short has some of every degradation.
    left = sorted(pairs, key=lambda pair: (names.index(pair[0]), pairs.index(pair)), reverse=True)
    running: dict[Future[list[Row]], tuple[str, str]] = {}
    with ProcessPoolExecutor(arguments.jobs, mp_context=context) as pool:
        while running or (left and time.monotonic() < ends):
            while left and len(running) < arguments.jobs and time.monotonic() < ends:
                pair = left.pop()
                running[pool.submit(run_pair, *pair, arguments)] = pair
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                pair = running.pop(future)
                error = future.exception()
                if error is None:
                    rows[pair] = future.result()
                else:
                    broken[" ".join(pair)] = repr(error)
                done = len(rows) + len(broken)
                print(f"{done}/{len(pairs)} {' '.join(pair)}", file=sys.stderr, flush=True)
                # A run takes long: what is done is kept, should it not reach its end.
                _write(arguments.json, {"rows": [as_record(row) for p in rows for row in rows[p]]})
    for pair in reversed(left):
        broken[" ".join(pair)] = "not begun: the minutes were over"
    return [row for pair in pairs for row in rows.get(pair, [])], broken


def parse_arguments(argv: Sequence[str] | None) -> argparse.Namespace:
    """Read the command line; lists come separated by commas."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--data", type=Path, help="directory with objects/ and scans/")
    parser.add_argument("--set", choices=("small", "all"), default="small", help="of --data")
    parser.add_argument("--only", default="", help="take only shapes whose name contains this")
    parser.add_argument("--effort", type=_among(("fast", "best")), default=["fast", "best"])
    parser.add_argument(
        "--degradations", type=_among(tuple(DEGRADATIONS)), default=list(DEGRADATIONS)
    )
    parser.add_argument("--peers", type=_among((*PEERS, *BOUNDS)), default=list(PEERS))
    parser.add_argument("--vertices", type=int, default=2500, help="of each shape made here")
    parser.add_argument("--cache", type=Path, help="directory to keep degraded meshes in")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    parser.add_argument("--minutes", type=float, default=np.inf, help="no pair begins later")
    parser.add_argument("--json", type=Path, help="file to write every row to")
    parser.add_argument("--speed", action="store_true", help="measure time and memory instead")
    parser.add_argument("--largest", type=int, default=1_000_000, help="vertices, with --speed")
    return parser.parse_args(argv)


def main(argv: Sequence[str] | None = None) -> int:
    """Run what the arguments ask for; exit code 1 if a method failed anywhere."""
    arguments = parse_arguments(argv)
    console = Console(width=None if sys.stdout.isatty() else 170)
    if arguments.speed:
        results = run_speed(arguments.largest)
        print_speed(results, console)
        _write(arguments.json, results)
        return int(any("trouble" in row for row in results["rows"] if row["method"] == "engine"))
    missing = {name: missing_library(name) for name in arguments.degradations}
    for name, library in missing.items():
        if library is not None:
            console.print(f"{name}: not run, needs {library}, of the bench extra")
    arguments.degradations = [name for name in arguments.degradations if missing[name] is None]
    rows, broken = run_comparison(arguments)
    summaries = summarise(rows)
    print_summaries(summaries, console)
    print_totals(rows, console)
    for pair, error in broken.items():
        console.print(f"{pair}: {error}", highlight=False)
    records = [as_record(row) for row in rows]
    _write(arguments.json, {"summaries": summaries, "rows": records, "broken": broken})
    failed = any(row.failed and row.method not in PEERS | BOUNDS for row in rows)
    return int(bool(broken) or not rows or failed)


def _among(names: tuple[str, ...]) -> Any:
    def parse(text: str) -> list[str]:
        chosen = [name for name in text.split(",") if name]
        for name in chosen:
            if name not in names:
                raise argparse.ArgumentTypeError(f"'{name}' is none of {', '.join(names)}")
        return chosen

    return parse


def _write(path: Path | None, results: Any) -> None:
    if path is not None:
        path.write_text(json.dumps(results, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
