"""Batches by URL, of two keys, while workers are killed: what is lost, held and delayed.

Starts a service of its own with two workers and a file server. One key sends most of the pairs as
one batch, the other a smaller batch after it. Printed are the jobs by how they ended, the memory
of the API, how the two keys' jobs alternated while both had some waiting, and the processor time
that each kind of process took. On its way it says how far it has come. After --minutes it cancels
what is left, and some minutes later it ends whatever has become of that. The exit code is 1 if a
job was lost or failed.

    python benchmarks/batch.py 10000 --kills 10
"""

from __future__ import annotations

import argparse
import os
import random
import secrets
import signal
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

# A script beside this one has the name of the package, which is to be found first.
sys.path.insert(0, str(Path(__file__).parents[1]))
from service_load import processor_seconds, resident

from service.access.keys import KeyStore
from service.client import Client
from service.stack import Stack
from worker.broker.connections import connect_text
from worker.settings import WorkerSettings

MEBIBYTE = 2**20
_SHARE = 5  # one pair in so many is the second key's
_OPTIONS = {"mode": "measure", "audit": False, "quality": {"samples": 16, "emd_samples": 16}}
_TINY = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"
_LOOK_INTERVAL = 1.0  # seconds
_TELL_INTERVAL = 30.0  # seconds
_CANCELING = 300.0  # seconds that canceling what is left may take


@dataclass
class Findings:
    """What came of a run.

    Attributes:
        accepted: seconds until each batch was answered with 202.
        memory: bytes of the API: before, after each batch was accepted, and at each look after.
        states: jobs by how they ended.
        attempts: how often jobs were started, all together.
        canceled: whether time was over before all had ended.
        runs: lengths of what one key had begun in a row while both had jobs waiting.
    """

    accepted: list[float] = field(default_factory=list)
    memory: list[int] = field(default_factory=list)
    states: Counter[str] = field(default_factory=Counter)
    attempts: int = 0
    kills: int = 0
    canceled: bool = False
    seconds: float = 0.0
    runs: list[int] = field(default_factory=list)
    used: Usage = field(default_factory=lambda: Usage())


@dataclass
class Usage:
    """Processor seconds by kind of process; those of a killed one up to the last look at it."""

    seen: dict[tuple[str, int], float] = field(default_factory=dict)

    def look(self, stack: Stack) -> None:
        """Note what each process has used so far."""
        for name, pid in stack.pids().items():
            kind = name.rstrip("0123456789 ")
            with suppress(OSError):
                self.seen[kind, pid] = processor_seconds(pid)
                self.seen[f"children of {kind}", pid] = children_seconds(pid)

    def by_kind(self) -> Mapping[str, float]:
        """In all, of each kind that has used any."""
        kinds = Counter[str]()
        for (kind, _), seconds in self.seen.items():
            kinds[kind] += seconds  # type: ignore[assignment] # a counter of seconds
        return {kind: seconds for kind, seconds in kinds.items() if seconds}


def main(argv: Sequence[str] | None = None) -> int:
    """Run it and print a table; exit code 1 if anything was lost."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("pairs", type=int, nargs="?", default=1000)
    parser.add_argument("--kills", type=int, default=10, help="workers to kill on the way")
    parser.add_argument("--every", type=int, help="jobs from one kill to the next")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--minutes", type=float, default=60, help="cancel what is left after it")
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args(argv)
    os.environ |= {
        "MESHCONE_REQUIRE_KEYS": "always",
        "MESHCONE_TRANSFER_PRIVATE_ADDRESSES": "true",
        "MESHCONE_KEY_REQUESTS_PER_MINUTE": "0",
    }
    with tempfile.TemporaryDirectory(prefix="meshcone-benchmark-") as name, files() as url:
        settings = WorkerSettings(data_dir=Path(name))
        with Stack(settings, workers=arguments.workers, log=Path(name) / "log") as stack:
            found = measure(stack, url, arguments)
    print_findings(found, arguments.pairs, Console(width=None if sys.stdout.isatty() else 100))
    ended = found.states["succeeded"] + found.states["canceled"]
    return 0 if ended == arguments.pairs else 1


@contextmanager
def files() -> Iterator[str]:
    """A server of this machine that has a tiny mesh under every name."""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Length", str(len(_TINY)))
            self.end_headers()
            self.wfile.write(_TINY)

        def log_message(self, *_arguments: object) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        server.daemon_threads = True
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


def measure(stack: Stack, url: str, arguments: argparse.Namespace) -> Findings:
    """Send both batches, kill workers while they are worked through, and look at every job."""
    luck, found = random.Random(arguments.seed), Findings()  # noqa: S311 - nothing secret
    api = stack.pids()["API"]
    found.memory.append(resident(api))
    with connect_text(stack.redis_url) as redis:
        tokens = [KeyStore(redis).create(name, ["submit", "read"]).token for name in "ab"]
    second = arguments.pairs // _SHARE
    with Client(stack.url, api_key=tokens[0]) as first, Client(stack.url, api_key=tokens[1]) as b:
        clients = [first, b]
        started = time.monotonic()
        ids = []
        for client, count in zip(clients, (arguments.pairs - second, second), strict=True):
            ids.append(send(client, count, url, found))
            found.memory.append(resident(api))
        every = arguments.every or max(1, arguments.pairs // (arguments.kills + 1))
        told = started
        while True:
            stack.restart_ended()
            found.used.look(stack)
            batches = [client.batch(batch) for client, batch in zip(clients, ids, strict=True)]
            ended = sum(
                batch.counts[state]
                for batch in batches
                for state in ("succeeded", "failed", "canceled")
            )
            found.memory.append(resident(api))
            if found.kills < arguments.kills and ended >= every * (found.kills + 1):
                found.kills += kill_one(stack, luck)
            passed = time.monotonic() - started
            if all(batch.state == "finished" for batch in batches):
                break
            if passed > 60 * arguments.minutes + _CANCELING:
                print("not all of what was canceled has ended", file=sys.stderr)
                break
            if time.monotonic() - told >= _TELL_INTERVAL:
                told = time.monotonic()
                words = f"{passed:.0f} s: {ended} of {arguments.pairs} ended, {found.kills} kills"
                print(words, file=sys.stderr, flush=True)
            if time.monotonic() - started > 60 * arguments.minutes and not found.canceled:
                found.canceled = True
                for client, batch in zip(clients, ids, strict=True):
                    client.cancel_batch(batch)
            time.sleep(_LOOK_INTERVAL)
        found.seconds = time.monotonic() - started
        look_at_jobs(clients, ids, found)
    return found


def send(client: Client, count: int, url: str, found: Findings) -> str:
    """Send a batch of so many pairs, each of a file of its own name; its id."""
    pairs: list[dict[str, Any]] = [
        {
            "name": f"pair-{number}",
            "source": {"url": f"{url}/{secrets.token_hex(4)}.obj"},
            "reference": {"url": f"{url}/reference.obj"},
        }
        for number in range(count)
    ]
    began = time.monotonic()
    batch = client.submit_batch(pairs, {"options": _OPTIONS})
    found.accepted.append(time.monotonic() - began)
    return batch.id


def kill_one(stack: Stack, luck: random.Random) -> int:
    """Kill one of the workers that the stack has started; how many that were."""
    pids = [pid for pid in stack.worker_pids() if pid in _children()]
    if not pids:
        return 0
    with suppress(ProcessLookupError):  # it has just ended by itself
        os.kill(luck.choice(pids), signal.SIGKILL)
        return 1
    return 0


def children_seconds(pid: int) -> float:
    """Processor time of those children of a process that have ended (Linux)."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[13]) + int(fields[14])) / os.sysconf("SC_CLK_TCK")


def _children() -> set[int]:
    """Process ids of what this process has started and has not ended (Linux)."""
    me = os.getpid()
    text = Path(f"/proc/{me}/task/{me}/children").read_text(encoding="ascii")
    return {int(pid) for pid in text.split()}


def look_at_jobs(clients: Sequence[Client], ids: Sequence[str], found: Findings) -> None:
    """Count the jobs, and how long one key's were begun in a row while the other's waited."""
    begun = []
    for key, (client, batch) in enumerate(zip(clients, ids, strict=True)):
        for job in client.batch_jobs(batch):
            found.states[job.state] += 1
            found.attempts += job.attempt
            if job.started is not None:
                begun.append((job.started, key))
    order = [key for _, key in sorted(begun)]
    last = min(
        max((place for place, key in enumerate(order) if key == each), default=-1)
        for each in range(len(clients))
    )
    first = order.index(1) if 1 in order else 0
    length = 0
    for place in range(first, last + 1):
        length += 1
        if place == last or order[place] != order[place + 1]:
            found.runs.append(length)
            length = 0


def print_findings(found: Findings, pairs: int, console: Console) -> None:
    """Print what was found."""
    table = Table(title=f"{pairs:,} pairs by URL, two keys, {found.kills} workers killed")
    table.add_column("what")
    table.add_column("found", justify="right")
    table.add_row("jobs by how they ended", str(dict(found.states)))
    table.add_row("lost", str(pairs - sum(found.states.values())))
    again = found.attempts - found.states["succeeded"]
    table.add_row("starts that did not end in success", str(again))
    table.add_row("seconds to 202, each batch", ", ".join(f"{each:.1f}" for each in found.accepted))
    table.add_row("jobs a second", f"{found.states['succeeded'] / found.seconds:.1f}")
    memory = [each / MEBIBYTE for each in found.memory]
    table.add_row("API, MiB before", f"{memory[0]:.0f}")
    table.add_row("API, MiB once both are accepted", f"{memory[2]:.0f}")
    table.add_row("API, MiB at most", f"{max(memory):.0f}")
    table.add_row("API, MiB at the end", f"{memory[-1]:.0f}")
    for kind, seconds in found.used.by_kind().items():
        each = 1000 * seconds / max(found.states["succeeded"], 1)
        table.add_row(f"processor ms a job: {kind}", f"{each:.1f}")
    if found.runs:
        mean = sum(found.runs) / len(found.runs)
        table.add_row("jobs of one key in a row: mean", f"{mean:.2f}")
        table.add_row("jobs of one key in a row: most", str(max(found.runs)))
    console.print(table)


if __name__ == "__main__":
    raise SystemExit(main())
