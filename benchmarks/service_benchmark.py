"""The service under load: latency, overhead, throughput, and the memory of the API.

Starts a service of its own on this machine: an embedded broker, the API and two workers.
The clients run on the same processors, and so does whatever else the machine does.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import anyio
import httpx2
import numpy as np
from reference_shapes import bumpy_torus
from rich.console import Console
from rich.table import Table
from service_load import (
    JOB_SECONDS,
    MULTIPART,
    form,
    load,
    percentiles,
    processor_seconds,
    resident,
    send_one,
    stream_form,
    watched,
)

from service.stack import Stack
from worker.settings import WorkerSettings

MEBIBYTE = 2**20
_LIMIT = 80 * MEBIBYTE  # of a request
_LARGE, _TOO_LARGE = 60 * 10**6, 100 * 10**6  # bytes
_OPTIONS = {"effort": "fast"}
_TINY = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"


def main(argv: Sequence[str] | None = None) -> int:
    """Measure, print a table and the figures as JSON; exit code 1 if a request failed."""
    arguments = parse_arguments(argv)
    os.environ["MESHCONE_MAX_UPLOAD_BYTES"] = str(_LIMIT)
    with tempfile.TemporaryDirectory(prefix="meshcone-benchmark-") as name:
        directory = Path(name)
        settings = WorkerSettings(data_dir=directory)
        with Stack(settings, workers=arguments.workers, log=directory / "log") as stack:
            results = measure(stack, arguments)
    print_results(results, Console(width=None if sys.stdout.isatty() else 120))
    print(json.dumps(results))
    if arguments.json is not None:
        arguments.json.write_text(json.dumps(results, indent=2) + "\n", encoding="utf-8")
    return int(bool(results["load"]["faults"] or results["tiny"]["faults"]))


def parse_arguments(argv: Sequence[str] | None) -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--clients", type=int, default=50, help="at a time")
    parser.add_argument("--seconds", type=float, default=60, help="that the load lasts")
    parser.add_argument("--jobs", type=int, default=30, help="sent one after the other")
    parser.add_argument("--json", type=Path, help="file to write the figures to")
    return parser.parse_args(argv)


def measure(stack: Stack, arguments: argparse.Namespace) -> dict[str, Any]:
    """Everything, one after the other."""
    source, reference = pair_of(10**6)
    body = form(source, reference, _OPTIONS)
    tiny = form(_TINY, _TINY, {"mode": "measure"})
    results: dict[str, Any] = {
        "machine": {"processors": os.cpu_count(), "load": os.getloadavg()[0]},
        "bytes": {"source": len(source), "reference": len(reference), "request": len(body)},
        "workers": arguments.workers,
    }
    with httpx2.Client(base_url=stack.url, timeout=60, trust_env=False) as http:
        send_one(http, body)  # the first one warms everybody up
        results["alone"] = alone(stack, http, body, arguments.jobs)
        results["tiny_alone"] = alone(stack, http, tiny, arguments.jobs)
        results["load"] = loaded(stack, body, arguments)
        drain(http)
        results["tiny"] = loaded(stack, tiny, arguments)
        drain(http)
    api = stack.pids()["API"]
    results["memory"] = anyio.run(memory_while_streaming, stack.url, api)
    results["refusal"] = anyio.run(refusals, stack.url, api)
    return results


def pair_of(size: int) -> tuple[bytes, bytes]:
    """A bumpy torus with noise and without, in OBJ files of about ``size`` bytes together."""
    mesh = bumpy_torus(size // 145)  # bytes a vertex takes in both, with its two faces
    noise = np.random.default_rng(1).normal(scale=0.005, size=mesh.vertices.shape)
    return _obj(mesh.vertices + noise, mesh.faces), _obj(mesh.vertices, mesh.faces)


def _obj(vertices: np.ndarray, faces: np.ndarray) -> bytes:
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices]
    lines += [f"f {a} {b} {c}" for a, b, c in faces + 1]
    return ("\n".join(lines) + "\n").encode()


def alone(stack: Stack, http: httpx2.Client, body: bytes, jobs: int) -> dict[str, Any]:
    """Jobs one after the other: what the service adds to the engine's own time."""
    pids = [stack.pids()[name] for name in ("API", "broker")]
    before = sum(map(processor_seconds, pids))
    sent = [send_one(http, body) for _ in range(jobs)]
    used = sum(map(processor_seconds, pids)) - before
    return {
        "api_and_broker_processor_ms": 1e3 * used / jobs,
        "submit_ms": percentiles([each.accepted for each in sent]),
        "overhead_ms": percentiles([each.ended - each.engine for each in sent]),
        "engine_ms": percentiles([each.engine for each in sent]),
    }


def loaded(stack: Stack, body: bytes, arguments: argparse.Namespace) -> dict[str, Any]:
    """Many clients at a time."""
    started = time.perf_counter()
    seen = anyio.run(load, stack.url, body, arguments.clients, arguments.seconds)
    seconds = time.perf_counter() - started
    return {
        "clients": arguments.clients,
        "seconds": seconds,
        "submit_ms": percentiles(seen.accepted),
        "jobs_per_second": seen.states["succeeded"] / seconds,
        "states": dict(seen.states),
        "statuses": {str(status): count for status, count in sorted(seen.statuses.items())},
        "faults": seen.faults,
    }


def drain(http: httpx2.Client) -> None:
    """Cancel what is left, and wait until nothing runs."""
    deadline = time.monotonic() + JOB_SECONDS
    while time.monotonic() < deadline:
        left = [
            job
            for state in ("queued", "running")
            for job in http.get("/v1/jobs", params={"state": state, "limit": 200}).json()["jobs"]
        ]
        if not left:
            return
        for job in left:
            if job["links"]["cancel"]:
                http.post(job["links"]["cancel"])
        time.sleep(0.2)
    raise AssertionError("jobs go on after they were canceled")


async def memory_while_streaming(url: str, pid: int) -> dict[str, float]:
    """The API's memory while large bodies come in, three at a time."""
    async with httpx2.AsyncClient(base_url=url, timeout=120, trust_env=False) as http:

        async def send() -> None:
            content = stream_form(_LARGE, [])
            answer = await http.post("/v1/jobs", content=content, headers=MULTIPART)
            assert answer.status_code == 202, answer.text

        await send()  # brings the buffers to the size they keep
        with watched(pid) as memory:
            started = time.perf_counter()
            for _ in range(3):
                async with anyio.create_task_group() as group:
                    for _ in range(3):
                        group.start_soon(send)
            seconds = time.perf_counter() - started
    return {
        "before_mib": memory.before / MEBIBYTE,
        "peak_mib": memory.peak / MEBIBYTE,
        "after_mib": resident(pid) / MEBIBYTE,
        "mb_per_second": 9 * _LARGE / 1e6 / seconds,
    }


async def refusals(url: str, pid: int) -> dict[str, Any]:
    """What becomes of a body that is too large, of declared and of undeclared length."""
    found: dict[str, Any] = {}
    length = sum([len(piece) async for piece in stream_form(_TOO_LARGE, [])])
    for name, headers in (
        ("declared", {**MULTIPART, "Content-Length": str(length)}),
        ("undeclared", MULTIPART),
    ):
        pieces: list[int] = []
        with watched(pid) as memory:
            async with httpx2.AsyncClient(base_url=url, timeout=60, trust_env=False) as http:
                content = stream_form(_TOO_LARGE, pieces)
                answer = await http.post("/v1/jobs", content=content, headers=headers)
        found[name] = {
            "status": answer.status_code,
            "type": answer.headers.get("content-type"),
            "sent_mb": sum(pieces) / 1e6,
            "grown_mib": (memory.peak - memory.before) / MEBIBYTE,
        }
    return found


def print_results(results: dict[str, Any], console: Console) -> None:
    """Print a line for each thing measured."""
    machine = results["machine"]
    sizes = results["bytes"]
    table = Table(
        title=f"{results['workers']} workers, {machine['processors']} processors with a load of "
        f"{machine['load']:.1f} before; files of {sizes['source'] / 1e6:.2f} and "
        f"{sizes['reference'] / 1e6:.2f} MB"
    )
    table.add_column("what")
    for heading in ("p50", "p99", "max", "n"):
        table.add_column(heading, justify="right")
    for title, section, key in (
        ("submit to 202, alone, ms", "alone", "submit_ms"),
        ("overhead outside the engine, ms", "alone", "overhead_ms"),
        ("the engine itself, ms", "alone", "engine_ms"),
        ("the same of a tiny measurement: submit, ms", "tiny_alone", "submit_ms"),
        ("… overhead, ms", "tiny_alone", "overhead_ms"),
        ("submit to 202 under load, ms", "load", "submit_ms"),
        ("… of tiny measurements, ms", "tiny", "submit_ms"),
    ):
        row = results[section][key]
        if row:
            cells = [f"{row[name]:.0f}" for name in ("p50", "p99", "max", "count")]
            table.add_row(title, *cells)
    console.print(table)
    console.print(
        "processor time of API and broker for one job, alone: "
        f"{results['alone']['api_and_broker_processor_ms']:.0f} ms, of a tiny one "
        f"{results['tiny_alone']['api_and_broker_processor_ms']:.0f} ms"
    )
    for title, section in (("load", "load"), ("load of tiny measurements", "tiny")):
        seen = results[section]
        console.print(
            f"{title}: {seen['clients']} clients, {seen['seconds']:.0f} s, "
            f"{seen['jobs_per_second']:.2f} jobs/s, answers {seen['statuses']}, "
            f"jobs {seen['states']}, faults {len(seen['faults'])}"
        )
    memory = results["memory"]
    console.print(
        f"memory of the API while bodies of 60 MB stream in: {memory['before_mib']:.0f} MiB "
        f"before, {memory['peak_mib']:.0f} at most, {memory['after_mib']:.0f} after; "
        f"{memory['mb_per_second']:.0f} MB/s"
    )
    for name, seen in results["refusal"].items():
        console.print(
            f"100 MB of {name} length: {seen['status']} {seen['type']} after "
            f"{seen['sent_mb']:.1f} MB, memory grown by {seen['grown_mib']:.1f} MiB"
        )
