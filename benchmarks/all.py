"""Every benchmark, one after the other, and one page with all their tables.

    python benchmarks/all.py [--quick] [--data DIR] [--only NAME ...] [--out FILE]

With --quick each is given small sizes: all of them take about ten minutes on two free cores.
--data is a directory with objects/, scans/, gltf/ and nasty/; benchmarks of stored files are named
as not run without it, as those are whose libraries or programs are not installed. The page says
on which machine, with which versions, when and beside how much other work the numbers were taken.
Exits with 1 if a benchmark fails or takes longer than it may.
"""

from __future__ import annotations

import argparse
import os
import platform
import resource
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path

from threads import thread_environment

_HERE = Path(__file__).parent
_PAGE = _HERE.parent / "docs" / "benchmarks.md"
_LIBRARIES = ("meshcone", "numpy", "scipy", "numba", "scs", "cvxpy", "libigl", "trimesh")
_SECONDS = {True: 1800, False: 6 * 3600}  # that one benchmark may take, quick or not


@dataclass(frozen=True)
class Benchmark:
    """A script, what it measures, and what it needs.

    Attributes:
        arguments: given always; ``{data}`` and ``{kept}`` stand for the data's directory and for
            an empty one.
        quick: given besides, to be quick.
        stored: whether it reads stored files, and so needs ``--data``.
        modules: libraries it cannot do without.
    """

    script: str
    title: str
    arguments: str = ""
    quick: str = ""
    stored: bool = False
    modules: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """What ``--only`` calls it: the script, and its first argument where that is a word."""
        word = self.arguments.partition(" ")[0]
        return f"{self.script} {word}" if word in {"--speed", "accepting"} else self.script

    def command(self, data: Path | None, kept: str, *, quick: bool) -> list[str]:
        """The words after ``python``."""
        words = f"{self.arguments} {self.quick if quick else ''}"
        return [f"benchmarks/{self.script}.py", *shlex.split(words.format(data=data, kept=kept))]

    def lacks(self, data: Path | None) -> str:
        """Why it cannot be run here, or nothing."""
        if self.stored and data is None:
            return "it reads stored files, and no `--data` was given"
        missing = [module for module in self.modules if find_spec(module) is None]
        return f"{', '.join(missing)} is not installed" if missing else ""


BENCHMARKS = (
    Benchmark("engine", "The engine on damaged shapes, beside its peers", quick="--vertices 600"),
    Benchmark("engine", "How long a refinement takes", "--speed", "--largest 5000"),
    Benchmark("profile_engine", "Where its time goes", quick="--subdivisions 4"),
    Benchmark("regions", "Regions beside the whole", quick="--vertices 3000"),
    Benchmark("confirming", "What SCS's confirmation costs", quick="--subdivisions 3 4"),
    Benchmark("memory", "Memory and time of one job", quick="--vertices 4096 16384"),
    Benchmark(
        "paper",
        "The paper's tables",
        "--results {kept}",
        "--vertices 300 --emd-samples 300 --only sphere",
    ),
    Benchmark("deviation", "Proven deviations beside sampled ones", quick="--dense 20000"),
    Benchmark("metrics", "What the metrics cost"),
    Benchmark("appearance", "The colour difference under changes that harm and that do not"),
    Benchmark("audit", "What an audit costs", quick="--triangles 20000"),
    Benchmark("damage", "Which damages the gates notice"),
    Benchmark("service", "The service under load", quick="--seconds 10 --jobs 5 --clients 10"),
    Benchmark("service", "How soon a job is accepted", "accepting", "--jobs 10 --at-once 5"),
    Benchmark("batch", "A batch by URL while workers are killed", quick="100 --kills 2"),
    Benchmark("batch_results", "What the verdicts of a batch cost", quick="500"),
    Benchmark(
        "pages", "What a job's page costs a browser", quick="--repeats 1", modules=("playwright",)
    ),
    Benchmark(
        "viewers",
        "Libraries that draw a mesh in a browser",
        quick="--repeats 1",
        modules=("playwright", "plotly"),
    ),
    Benchmark("agreement", "Metrics beside others' implementations", "--data {data}", stored=True),
    Benchmark("detail", "Detail beside uniform subdivision", "--data {data}", stored=True),
    Benchmark("round_trip", "What changes in a file", "--data {data}/gltf", stored=True),
    Benchmark("torture", "Readers on files made to hurt", "--data {data}", stored=True),
    Benchmark("wild", "Which files are accepted", "{data}/gltf", stored=True),
    Benchmark(
        "khronos",
        "Refined files before Khronos' validator",
        "--data {data}/gltf --validator .venv",
        stored=True,
    ),
)


@dataclass(frozen=True)
class Run:
    """What came of one benchmark."""

    benchmark: Benchmark
    command: str
    output: str
    processor_seconds: float
    trouble: str


def main(argv: Sequence[str] | None = None) -> int:
    """Run what can be run, print every table, write the page."""
    arguments = parse_arguments(argv)
    runs, skipped, started = [], [], datetime.now(UTC)
    for benchmark in chosen(arguments.only):
        if lacking := benchmark.lacks(arguments.data):
            skipped.append(f"- `{benchmark.name}`: {lacking}.")
            continue
        print(f"== {benchmark.name}: {benchmark.title}", flush=True)
        runs.append(run(benchmark, arguments.data, quick=arguments.quick))
        print(runs[-1].output + runs[-1].trouble, flush=True)
        # A run that is interrupted leaves what it has.
        arguments.out.write_text(page(runs, skipped, started, quick=arguments.quick))
    arguments.out.write_text(page(runs, skipped, started, quick=arguments.quick))
    print("\n".join([*skipped, f"written to {arguments.out}"]))
    return int(any(each.trouble for each in runs))


def parse_arguments(argv: Sequence[str] | None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="small sizes: about ten minutes")
    parser.add_argument("--data", type=Path, help="directory of stored files")
    names = sorted({benchmark.name for benchmark in BENCHMARKS})
    parser.add_argument("--only", nargs="*", choices=names, default=names, metavar="NAME")
    parser.add_argument("--out", type=Path, default=_PAGE, help="page to write")
    return parser.parse_args(argv)


def chosen(names: Sequence[str]) -> Iterator[Benchmark]:
    """The benchmarks of these names, in the order of the page."""
    yield from (benchmark for benchmark in BENCHMARKS if benchmark.name in names)


def run(benchmark: Benchmark, data: Path | None, *, quick: bool) -> Run:
    """Run one in a process of its own, on one thread."""
    with tempfile.TemporaryDirectory() as kept:
        command = benchmark.command(data, kept, quick=quick)
        before = _processor_seconds()
        try:
            done = subprocess.run(
                [sys.executable, *command],
                cwd=_HERE.parent,
                env=thread_environment(1) | {"COLUMNS": "150", "PYTHONUNBUFFERED": "1"},
                capture_output=True,
                text=True,
                check=False,
                timeout=_SECONDS[quick],
            )
        except subprocess.TimeoutExpired as expired:
            output = (expired.stdout or b"").decode(errors="replace")
            trouble = f"It did not end within {_SECONDS[quick]} s.\n"
        else:
            output = done.stdout
            trouble = f"It ended with {done.returncode}.\n" if done.returncode else ""
            if trouble:
                print(done.stderr, file=sys.stderr)
    words = [word.replace(kept, "DIRECTORY").replace(str(data), "DATA") for word in command]
    spent = _processor_seconds() - before
    return Run(benchmark, shlex.join(words), output, spent, trouble)


def _processor_seconds() -> float:
    spent = resource.getrusage(resource.RUSAGE_CHILDREN)
    return spent.ru_utime + spent.ru_stime


def page(runs: Sequence[Run], skipped: Sequence[str], started: datetime, *, quick: bool) -> str:
    """All tables as Markdown, below what they were taken with."""
    way = "python benchmarks/all.py" + (" --quick" if quick else "")
    small = " Sizes are small, so that all of it takes minutes." if quick else ""
    parts = [
        "# Benchmarks\n",
        f"Written by `{way}`, which is not edited by hand.{small} [Performance](performance.md) "
        "explains what is measured,\nand has the numbers at full size.\n",
        surroundings(started),
    ]
    if skipped:
        parts += ["Not run:\n", "\n".join(skipped) + "\n"]
    for each in runs:
        parts.append(f"## {each.benchmark.title}\n")
        parts.append(f"`python {each.command}`, {each.processor_seconds:.0f} processor seconds.\n")
        if each.trouble:
            parts.append(each.trouble)
        lines = [line.rstrip() for line in each.output.strip("\n").splitlines()]
        parts.append("\n".join(["```text", *lines, "```\n"]))
    return "\n".join(parts)


def surroundings(started: datetime) -> str:
    """Machine, versions, date and load, as a table."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30
    minutes = (datetime.now(UTC) - started).total_seconds() / 60
    load = os.getloadavg()[2]
    rows = {
        "date": f"{started:%Y-%m-%d %H:%M} UTC, {minutes:.0f} minutes",
        "processor": f"{_processor()}, {os.cpu_count()} cores",
        "memory": f"{memory:.0f} GiB",
        "system": f"{platform.system()} {platform.machine()}, Python {platform.python_version()}",
        "versions": ", ".join(f"{name} {_version(name)}" for name in _LIBRARIES),
        "load": f"{load:.1f} processes waited for or had a processor, with what else ran",
    }
    return "\n".join(["| | |", "|---|---|", *(f"| {k} | {v} |" for k, v in rows.items()), ""])


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"


def _processor() -> str:
    """The processor as the system calls it."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor() or "unknown"
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return models[0] if models else platform.processor() or "unknown"


if __name__ == "__main__":
    sys.exit(main())
