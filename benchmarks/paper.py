"""The tables of the paper, measured again on other shapes, with the paper's numbers beside.

    OMP_NUM_THREADS=1 python benchmarks/paper.py --data DIRECTORY --results DIRECTORY

The shapes are the first 53 of DIRECTORY/objects and DIRECTORY/scans; the table of detailed scans
takes all of the latter. Every shape has a file of results; what it holds is not measured again,
so that a run can be interrupted and continued, and a later one can add what takes long:

    --stages metrics,solver,ablations   half a minute a shape (the default)
    --stages best,tight                 the engine's best effort; caps on a third of the edges
    --stages emd                        the earth mover's distance from 5,000 samples
    --stages ""                         only print what there is

Results belong to one version of the code: a changed program needs another directory. Without
--data it takes a few shapes made here.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from threads import limit_threads

limit_threads(1)  # before the libraries below are loaded, here and in the pool's processes

from paper_measures import (  # noqa: E402
    BEST_MEASURED,
    MEASURED,
    SCAN_MEASURED,
    Counts,
    measure_ablations,
    measure_all,
    measure_emd,
    measure_solver,
)
from paper_meshes import PaperMeshes  # noqa: E402
from paper_program import LOOSE, TIGHT  # noqa: E402
from paper_tables import Results, all_tables  # noqa: E402
from reference_shapes import Shape, made_shapes, stored_shapes  # noqa: E402

PAPER_SHAPES = 53
STAGES = ("metrics", "solver", "ablations", "best", "tight", "emd")


def chosen_shapes(arguments: argparse.Namespace) -> tuple[list[Shape], list[Shape]]:
    """The shapes of the main tables, and those of the table of scans."""
    if arguments.data is None:
        made = [shape for shape in made_shapes(arguments.vertices) if arguments.only in shape.name]
        return made, made[:1]
    shapes = stored_shapes(arguments.data, small=False)
    scanned = {path.name.split(".")[0] for path in (arguments.data / "scans").glob("*")}
    main = [shape for shape in shapes[:PAPER_SHAPES] if arguments.only in shape.name]
    scans = [s for s in shapes if s.name in scanned and arguments.only in s.name]
    return main, scans


def run_shape(name: str, arguments: argparse.Namespace) -> None:
    """Measure what is asked for and not yet in a shape's file of results."""
    main, scans = chosen_shapes(arguments)
    shape = next(shape for shape in [*main, *scans] if shape.name == name)
    in_main, in_scans = (any(other.name == name for other in part) for part in (main, scans))
    measured = [*(MEASURED if in_main else []), *(SCAN_MEASURED if in_scans else [])]
    path = result_path(arguments.results, name)
    results = read_results(path)
    meshes = PaperMeshes(shape.load(), arguments.results / name)
    counts = Counts(arguments.emd_samples, arguments.more_emd_samples)
    measures: dict[str, Callable[[], Any]] = {
        "metrics": partial(measure_all, meshes, list(dict.fromkeys(measured)), counts),
        "best": partial(measure_all, meshes, BEST_MEASURED, counts),
        "solver": partial(measure_solver, meshes),
        "ablations": partial(measure_ablations, meshes, LOOSE),
        "tight": partial(measure_ablations, meshes, [TIGHT]),
        "emd": partial(measure_emd, meshes, counts),
    }
    for stage in arguments.stages:
        if stage in results or not (in_main or stage == "metrics"):
            continue
        started = time.process_time()
        results[stage] = measures[stage]()
        results.setdefault("seconds", {})[stage] = time.process_time() - started
        write_results(path, results)


def result_path(directory: Path, shape: str) -> Path:
    """Where a shape's results are kept."""
    return directory / f"{shape}.json"


def read_results(path: Path) -> dict[str, Any]:
    """What is known of a shape so far."""
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def write_results(path: Path, results: dict[str, Any]) -> None:
    """Replace a shape's results as a whole: a run may be stopped at any moment."""
    path.parent.mkdir(parents=True, exist_ok=True)
    partial_file = path.with_suffix(".partial")
    partial_file.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    partial_file.replace(path)


def collected(arguments: argparse.Namespace) -> Results:
    """The results there are of all shapes asked for."""
    main, scans = (
        {shape.name: read_results(result_path(arguments.results, shape.name)) for shape in shapes}
        for shapes in chosen_shapes(arguments)
    )
    return Results(main, scans, arguments.emd_samples, arguments.more_emd_samples)


def parse_arguments(argv: Sequence[str] | None) -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--data", type=Path, help="directory with objects/ and scans/")
    parser.add_argument("--results", type=Path, required=True, help="directory to keep results in")
    parser.add_argument("--stages", type=_stages, default=list(STAGES[:3]))
    parser.add_argument("--only", default="", help="take only shapes whose name contains this")
    parser.add_argument("--emd-samples", type=int, default=Counts.emd)
    parser.add_argument("--more-emd-samples", type=int, default=Counts.more_emd)
    parser.add_argument("--vertices", type=int, default=2500, help="of each shape made here")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    return parser.parse_args(argv)


def main(argv: Sequence[str] | None = None) -> int:
    """Measure, and print the tables in Markdown; exit code 1 if a shape failed."""
    arguments = parse_arguments(argv)
    names = list(dict.fromkeys(s.name for part in chosen_shapes(arguments) for s in part))
    failed = False
    if arguments.stages:
        with ProcessPoolExecutor(arguments.jobs, mp_context=get_context("spawn")) as pool:
            futures = {pool.submit(run_shape, name, arguments): name for name in names}
            for done, future in enumerate(as_completed(futures), start=1):
                error = future.exception()
                failed = failed or error is not None
                outcome = "" if error is None else f": {error!r}"
                place = f"{done}/{len(names)} {futures[future]}"
                print(place + outcome, file=sys.stderr, flush=True)
    print("\n".join(all_tables(collected(arguments))))
    return int(failed)


def _stages(text: str) -> list[str]:
    chosen = [name for name in text.split(",") if name]
    for name in chosen:
        if name not in STAGES:
            raise argparse.ArgumentTypeError(f"'{name}' is none of {', '.join(STAGES)}")
    return chosen


if __name__ == "__main__":
    sys.exit(main())
