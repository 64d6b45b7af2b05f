"""From the first byte of a pair of 1 MB to its 202, with the files checked first and without.

    python benchmarks/service.py accepting [--jobs 40] [--at-once 20]

Starts a service of its own with one worker. Between two rounds every job is canceled and
waited for, so that no worker is busy while a client waits.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
import uuid
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import httpx2
from rich.console import Console
from rich.table import Table
from service_benchmark import drain, pair_of
from service_load import MULTIPART, form, percentiles

from service.stack import Stack
from worker.settings import WorkerSettings

Pair = tuple[bytes, bytes]
_CHECKED = {"checked first": "16777216", "left to a worker": "0"}  # bytes that are checked


def main(argv: Sequence[str] | None = None) -> int:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--jobs", type=int, default=40, help="sent one after the other")
    parser.add_argument("--at-once", type=int, default=20, help="sent together, twice")
    arguments = parser.parse_args(argv)
    pair = pair_of(10**6)
    table = Table(title=f"submit to 202, ms; load of {os.getloadavg()[0]:.1f} before")
    for heading in ("files", "requests", "p50", "p99", "max", "refused"):
        table.add_column(heading, justify="right")
    for name, size in _CHECKED.items():
        os.environ["MESHCONE_PRECHECK_BYTES"] = size
        with tempfile.TemporaryDirectory(prefix="meshcone-benchmark-") as directory:
            settings = WorkerSettings(data_dir=Path(directory))
            with Stack(settings, log=Path(directory) / "log") as stack:
                one = one_by_one(stack.url, pair, arguments.jobs)
                many = together(stack.url, pair, arguments.at_once)
        for title, (taken, refused) in (
            (f"{arguments.jobs} one by one", one),
            (f"{arguments.at_once} at once, twice", many),
        ):
            row = percentiles(taken)
            cells = [f"{row[key]:.0f}" for key in ("p50", "p99", "max")]
            table.add_row(name, title, *cells, str(refused))
    Console(width=None if sys.stdout.isatty() else 100).print(table)
    return 0


def one_by_one(url: str, pair: Pair, jobs: int) -> tuple[list[float], int]:
    """Seconds of each request that was accepted, and how many were not."""
    with httpx2.Client(base_url=url, timeout=60, trust_env=False) as http:
        found = []
        for _ in range(jobs + 1):
            found.append(send(http, pair))
            drain(http)
    return accepted(found[1:])  # the first one warms everybody up


def together(url: str, pair: Pair, count: int) -> tuple[list[float], int]:
    """The same of many clients at a time."""
    found: list[float | None] = []
    limits = httpx2.Limits(max_connections=count)
    with (
        httpx2.Client(base_url=url, timeout=60, trust_env=False, limits=limits) as http,
        ThreadPoolExecutor(count) as clients,
    ):
        for _ in range(2):
            found += clients.map(lambda _: send(http, pair), range(count))
            drain(http)
    return accepted(found)


def send(http: httpx2.Client, pair: Pair) -> float | None:
    """Seconds from the first byte to the 202; None if there was none."""
    # Files that the service does not have yet: those that it has are not stored again.
    source, reference = (mesh + f"# {uuid.uuid4()}\n".encode() for mesh in pair)
    body = form(source, reference, {"effort": "fast"})
    started = time.perf_counter()
    answer = http.post("/v1/jobs", content=body, headers=MULTIPART)
    return time.perf_counter() - started if answer.status_code == 202 else None


def accepted(found: Sequence[float | None]) -> tuple[list[float], int]:
    """Those that were, and the number of those that were not."""
    taken = [seconds for seconds in found if seconds is not None]
    return taken, len(found) - len(taken)
