"""What the service benchmark does: clients, and a look at the memory of a process."""

from __future__ import annotations

import json
import os
import secrets
import threading
import time
from collections import Counter
from collections.abc import AsyncIterator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import anyio
import httpx2
import numpy as np

JOB_SECONDS = 120  # longest wait for one job
_BOUNDARY = "meshcone-benchmark"
MULTIPART = {"Content-Type": f"multipart/form-data; boundary={_BOUNDARY}"}
CHUNK = 64 * 1024  # bytes


@dataclass(frozen=True)
class Sent:
    """One job, as its sender saw it.

    Attributes:
        accepted: seconds from the first byte sent to the 202.
        ended: seconds from the first byte sent to knowing that it has ended.
        engine: seconds the engine itself took, by its report.
    """

    accepted: float
    ended: float
    engine: float


@dataclass
class Load:
    """What many clients have seen together."""

    statuses: Counter[int] = field(default_factory=Counter)
    states: Counter[str] = field(default_factory=Counter)
    accepted: list[float] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)


def part(name: str, data: bytes, filename: str = "") -> bytes:
    """A part of the form."""
    named = f'; filename="{filename}"' if filename else ""
    head = f'--{_BOUNDARY}\r\nContent-Disposition: form-data; name="{name}"{named}\r\n\r\n'
    return head.encode() + data + b"\r\n"


def form(source: bytes, reference: bytes, options: dict[str, Any]) -> bytes:
    """The body of a submission."""
    parts = [
        part("options", json.dumps(options).encode()),
        part("source", source, "source.obj"),
        part("reference", reference, "reference.obj"),
    ]
    return b"".join(parts) + closing()


def closing() -> bytes:
    """What ends a form."""
    return f"--{_BOUNDARY}--\r\n".encode()


def send_one(http: httpx2.Client, body: bytes) -> Sent:
    """Send a job and follow it to its end by its events, which tell at once."""
    started = time.perf_counter()
    answer = http.post("/v1/jobs", content=body, headers=MULTIPART)
    accepted = time.perf_counter() - started
    assert answer.status_code == 202, answer.text
    links = answer.json()["links"]
    _await_end(http, links["events"])
    ended = time.perf_counter() - started
    report = http.get(f"{links['self']}/report").raise_for_status().json()
    return Sent(accepted, ended, report["timings"]["total"])


def _await_end(http: httpx2.Client, path: str) -> None:
    with http.stream("GET", path, timeout=JOB_SECONDS) as events:
        for line in events.iter_lines():
            if line.startswith("data:") and '"state"' in line:
                state = json.loads(line.removeprefix("data:")).get("state")
                assert state not in ("failed", "canceled"), line
                if state == "succeeded":
                    return
    raise AssertionError("the events ended before the job")


async def load(url: str, body: bytes, clients: int, seconds: float) -> Load:
    """Have clients send jobs and fetch their results, one after the other, for some time."""
    seen = Load()
    deadline = time.monotonic() + seconds
    limits = httpx2.Limits(max_connections=clients)
    async with (
        httpx2.AsyncClient(base_url=url, timeout=60, trust_env=False, limits=limits) as http,
        anyio.create_task_group() as group,
    ):
        for _ in range(clients):
            group.start_soon(_client, http, body, deadline, seen)
    return seen


async def _client(http: httpx2.AsyncClient, body: bytes, deadline: float, seen: Load) -> None:
    while time.monotonic() < deadline:
        try:
            await _round(http, body, deadline, seen)
        except httpx2.HTTPError as error:
            seen.faults.append(f"{type(error).__name__}: {error}")


async def _round(http: httpx2.AsyncClient, body: bytes, deadline: float, seen: Load) -> None:
    started = time.perf_counter()
    answer = await http.post("/v1/jobs", content=body, headers=MULTIPART)
    seen.statuses[answer.status_code] += 1
    if answer.status_code == 503 and "retry-after" in answer.headers:
        await anyio.sleep(float(answer.headers["retry-after"]))
        return
    if answer.status_code != 202:
        seen.faults.append(f"{answer.status_code}: {answer.text[:200]}")
        return
    seen.accepted.append(time.perf_counter() - started)
    path = answer.json()["links"]["self"]
    while time.monotonic() < deadline:
        job = await http.get(path)
        seen.statuses[job.status_code] += 1
        state = job.json().get("state", "")
        if state not in ("queued", "running"):
            seen.states[state] += 1
            result = await http.get(f"{path}/report")
            seen.statuses[result.status_code] += 1
            return
        await anyio.sleep(0.5)


async def stream_form(size: int, pieces: list[int]) -> AsyncIterator[bytes]:
    """A form whose source is about so many bytes, made while it is sent.

    Args:
        size: bytes of the source.
        pieces: gets the length of each piece as it is taken.
    """
    yield part("options", b"{}")
    yield part("source", b"", "source.obj")[:-2]
    noise = secrets.token_hex(16)  # or all of them were one blob
    line = f"# {noise} ".encode().ljust(63, b".") + b"\n"
    chunk = line * (CHUNK // len(line))
    for _ in range(size // len(chunk)):
        pieces.append(len(chunk))
        yield chunk
    yield b"\r\n" + part("reference", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "reference.obj")
    yield closing()


def resident(pid: int) -> int:
    """Bytes of memory a process holds that are its own (Linux)."""
    status = Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    fields = dict(line.split(":", 1) for line in status.splitlines())
    return int(fields["RssAnon"].split()[0]) * 1024


def processor_seconds(pid: int) -> float:
    """Processor time a process has used, which others on the machine do not lengthen (Linux)."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


@dataclass
class Memory:
    """What a process held while it was watched, in bytes."""

    before: int
    peak: int


@contextmanager
def watched(pid: int) -> Iterator[Memory]:
    """Look at a process's memory every 10 ms."""
    memory = Memory(resident(pid), resident(pid))
    done = threading.Event()

    def look() -> None:
        while not done.wait(0.01):
            memory.peak = max(memory.peak, resident(pid))

    thread = threading.Thread(target=look)
    thread.start()
    try:
        yield memory
    finally:
        done.set()
        thread.join()


def percentiles(values: list[float]) -> dict[str, float]:
    """Median, 99th percentile and largest, in milliseconds."""
    if not values:
        return {}
    p50, p99 = np.percentile(values, [50, 99])
    return {"p50": 1e3 * p50, "p99": 1e3 * p99, "max": 1e3 * max(values), "count": len(values)}
