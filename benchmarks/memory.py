"""Memory and time of one job by the size of its meshes: what the default limits rest on.

    python benchmarks/memory.py [--vertices 65536 262144 1000000] [--work refine measure]

Each job runs alone, in a child forked as a worker forks its horse: from a process that has
imported the engine. Memory is what ``MESHCONE_JOB_MEMORY_BYTES`` limits (private memory that
can be written, Linux), beyond what the parent held.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from threads import limit_threads

limit_threads(1)

import numpy as np  # noqa: E402 - the libraries read how many threads they have as they are loaded
from reference_shapes import bumpy_torus  # noqa: E402
from rich.console import Console  # noqa: E402
from rich.table import Table  # noqa: E402

from meshcone.files import MeshFile  # noqa: E402
from meshcone.options import parse_options  # noqa: E402
from meshcone.verbs.measure import measurement  # noqa: E402
from meshcone.verbs.refine import refine  # noqa: E402
from worker.run.artifacts import of_measurement, of_refinement  # noqa: E402

_WORK: Mapping[str, Mapping[str, Any]] = {
    "measure": {"mode": "measure"},
    "refine": {"effort": "fast"},
    "best": {"effort": "best"},
    "edges": {"effort": "fast", "cones": {"edge_cap": {"times_input": 1.0}}},
}
_LOOK_INTERVAL = 0.01  # seconds


def main(argv: Sequence[str] | None = None) -> int:
    """Measure every size and kind of work, one after the other, and print a row for each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--vertices", type=int, nargs="+", default=[16_384, 65_536, 262_144])
    parser.add_argument("--work", nargs="+", choices=_WORK, default=["measure", "refine"])
    arguments = parser.parse_args(argv)
    table = Table(title="one thread; an OBJ of positions, texture coordinates and normals")
    for heading in ("vertices", "faces", "work", "file, MB", "memory, GB", "a vertex, KB", "s"):
        table.add_column(heading, justify="right")
    for vertices in arguments.vertices:
        pair = pair_of(vertices)
        for work in arguments.work:
            table.add_row(*row(pair, work))

    Console(width=None if sys.stdout.isatty() else 100).print(table)
    return 0


def row(pair: tuple[MeshFile, MeshFile], work: str) -> list[str]:
    """Do one job; the cells of its row."""
    source, reference = pair
    vertices, faces = (source.data.count(start) for start in (b"\nv ", b"\nf "))
    options = parse_options(_WORK[work])

    def job() -> None:
        if options.mode == "measure":
            of_measurement(source.name, measurement(source, reference, options))
        else:
            of_refinement(source.name, refine(source, reference, options))

    started = time.perf_counter()
    taken = memory_of(job)
    seconds = time.perf_counter() - started
    return [
        f"{vertices:,}",
        f"{faces:,}",
        work,
        f"{len(source.data) / 1e6:.0f}",
        f"{taken / 1e9:.2f}",
        f"{taken / 1e3 / vertices:.1f}",
        f"{seconds:.0f}",
    ]


def memory_of(job: Callable[[], None]) -> int:
    """Bytes that a job takes at most, in a child forked from this process.

    Raises:
        ChildProcessError: it failed.
    """
    held = data_of(os.getpid())
    child = os.fork()
    if child == 0:
        job()
        os._exit(0)
    peak, ended, status = 0, 0, 0
    while not ended:
        peak = max(peak, data_of(child))
        time.sleep(_LOOK_INTERVAL)
        ended, status = os.waitpid(child, os.WNOHANG)
    if status:
        raise ChildProcessError(f"a job ended with {os.waitstatus_to_exitcode(status)}")
    return peak - held


def data_of(pid: int) -> int:
    """Bytes of private memory that a process can write, as the kernel limits them."""
    for line in Path(f"/proc/{pid}/status").read_text(encoding="ascii").splitlines():
        if line.startswith("VmData:"):
            return int(line.split()[1]) * 1024
    return 0  # it has ended


def pair_of(vertices: int) -> tuple[MeshFile, MeshFile]:
    """A bumpy torus with noise of a third of an edge, and without."""
    mesh = bumpy_torus(vertices)
    noise = np.random.default_rng(1).normal(size=mesh.vertices.shape)
    edge = float(
        np.linalg.norm(
            mesh.vertices[mesh.faces[:, 0]] - mesh.vertices[mesh.faces[:, 1]], axis=1
        ).mean()
    )
    return (
        MeshFile("noisy.obj", obj(mesh.vertices + 0.3 * edge * noise, mesh.faces)),
        MeshFile("torus.obj", obj(mesh.vertices, mesh.faces)),
    )


def obj(vertices: np.ndarray, faces: np.ndarray) -> bytes:
    """A file with a texture coordinate and a normal for each vertex, as exporters write it."""
    normals = vertices / np.linalg.norm(vertices, axis=1, keepdims=True)
    lines = ["# torus"]
    lines += [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices]
    lines += [f"vt {(x + 2) / 4:.6f} {(y + 2) / 4:.6f}" for x, y, _ in vertices]
    lines += [f"vn {x:.6f} {y:.6f} {z:.6f}" for x, y, z in normals]
    lines += [f"f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}" for a, b, c in faces + 1]
    return ("\n".join(lines) + "\n").encode()


if __name__ == "__main__":
    sys.exit(main())
