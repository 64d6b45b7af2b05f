"""Gives every file under gltf/ and nasty/ to the readers, and counts how each ends.

    python benchmarks/torture.py --data DIR [--json FILE] [--only NAME]

Each file is read in a process of its own with 5 seconds and 1 GB of address space. What is read
is compared with an independent decoding of the file, and written back: unmoved, which must give
the same bytes, and moved, which must give the moved positions. A row is bad if it ends in
anything but ``ok``, ``input`` or ``limit``, or if what it read or wrote is not what it should
be. Exit code 1 if any row is bad.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import resource
import sys
import time
import traceback
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import numpy as np
from independent import Polygon, UndecodedError, decode
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from meshcone.assets import Asset, read_asset
from meshcone.errors import MeshConeError
from meshcone.files import MeshFile
from meshcone.local_files import read_local

SECONDS = 5.0
MEMORY = 1024**3
FOLDERS = ("gltf", "nasty")

_FORK = multiprocessing.get_context("fork")


@dataclass(frozen=True)
class Row:
    """How one file ended.

    Attributes:
        ending: ok, input, limit, crash, timeout or memory.
        compared: whether an independent decoding was there to compare with.
        written: same bytes if unmoved, moved if moved; or why it cannot be written.
        faults: what is wrong; empty if the row is good.
    """

    file: str
    format: str
    ending: str
    seconds: float
    said: str
    compared: bool
    written: str
    faults: tuple[str, ...]


def run(path: Path, name: str) -> Row:
    """Read a file in one process, and check what was read in another."""
    started = time.perf_counter()
    ending, found = in_child(lambda: _read(read_local(path)), SECONDS, MEMORY)
    seconds = time.perf_counter() - started
    if ending != "ok":
        faults = () if ending in ("input", "limit") else (ending,)
        return Row(name, "-", ending, seconds, str(found), False, "-", faults)
    kind, written, wrong = found
    checked, result = in_child(lambda: _compare(read_local(path)), 20 * SECONDS, 4 * MEMORY)
    compared, faults = result if checked == "ok" else (False, (f"comparison: {checked} {result}",))
    return Row(name, kind, ending, seconds, "", compared, written, (*wrong, *faults))


def in_child(work: Callable[[], Any], seconds: float, memory: int) -> tuple[str, Any]:
    """Run something in a process of its own.

    Returns:
        How it ended, and its answer or what it said.
    """
    receiver, sender = _FORK.Pipe(duplex=False)
    child = _FORK.Process(target=_bounded, args=(work, sender, memory))
    child.start()
    sender.close()
    try:
        ended: tuple[str, Any] = receiver.recv() if receiver.poll(seconds) else ("timeout", "")
    except EOFError:
        ended = "crash", "the process died"
    child.kill()
    child.join()
    return ended


def _bounded(work: Callable[[], Any], sender: Connection, memory: int) -> None:
    resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    try:
        sender.send(("ok", work()))
    except MeshConeError as error:
        sender.send((error.kind, str(error)))
    except MemoryError:
        sender.send(("memory", ""))
    except BaseException:  # noqa: BLE001 - a traceback of any kind is what is searched for
        sender.send(("crash", traceback.format_exc(limit=-3)))


def _read(file: MeshFile) -> tuple[str, str, tuple[str, ...]]:
    asset = read_asset(file.name, file.data, file.resources)
    try:
        unmoved = asset.patched(asset.vertices)
    except MeshConeError as error:
        return asset.format, str(error), ()
    wrong = () if unmoved == file.data else ("unmoved: other bytes",)
    span = float(np.ptp(asset.vertices, axis=0).max())
    moved = asset.vertices + span * np.sin(np.arange(3) + asset.vertices / (span or 1.0)) / 100
    try:
        again = read_asset(file.name, asset.patched(moved), file.resources)
    except MeshConeError as error:
        return asset.format, f"moved: {error}", wrong
    step = span / 250 if b"KHR_mesh_quantization" in file.data else 2e-6 * span
    return asset.format, "moved", (*wrong, *_misplaced(asset, again, moved, step))


def _misplaced(
    asset: Asset, again: Asset, moved: NDArray[np.float64], step: float
) -> Iterator[str]:
    used = asset.weld >= 0
    if len(again.positions) != len(asset.positions):
        yield "moved: other vertices"
        return
    reach = float(np.abs(moved).max())
    offset = np.abs(again.positions[used] - moved[asset.weld[used]]).max()
    if not offset <= step + 1e-6 * reach:
        yield f"moved: {offset:g} from where it should be, of {reach:g}"


def _compare(file: MeshFile) -> tuple[bool, tuple[str, ...]]:
    asset = read_asset(file.name, file.data, file.resources)
    try:
        polygons = decode(asset.format, file.data, file.resources)
    except UndecodedError:
        return False, ()
    return True, tuple(differences(asset, polygons))


def differences(asset: Asset, polygons: list[Polygon]) -> Iterator[str]:
    """What a reader made of a file other than it should have.

    Compared are the positions, the vector area and the enclosed volume, which do not depend
    on how a flat polygon is cut into triangles.
    """
    stacks = _stacked(polygons)
    whole = [stack[_has_distinct_corners(stack)].reshape(-1, 3) for stack in stacks]
    reach = max(float(np.abs(stack).max()) for stack in stacks)
    if not _covered(asset.vertices, np.concatenate([s.reshape(-1, 3) for s in stacks]), reach):
        yield "a position that is not in the file"
    if not _covered(np.concatenate(whole), asset.vertices, reach):
        yield "a position of the file is missing"
    triangles = asset.vertices[asset.faces]
    flat = all(stack.shape[1] == 3 for stack in stacks)
    for what, moments, tolerance in (
        ("vector area", _vector_areas, 1e-6),
        ("volume", _volumes, 1e-6 if flat else 2e-2),
    ):
        size = float(np.abs(moments(triangles)).sum())
        expected = sum(moments(stack).sum(axis=0) for stack in stacks)
        found = moments(triangles).sum(axis=0)
        if not np.abs(expected - found).max() <= tolerance * size + 1e-300:
            yield f"{what} {found} instead of {expected}"


def _stacked(polygons: list[Polygon]) -> list[Polygon]:
    """Polygons of one size at a time, each as (k, n, 3)."""
    by_size: dict[int, list[Polygon]] = defaultdict(list)
    for polygon in polygons:
        by_size[len(polygon)].append(polygon)
    return [np.stack(family) for size, family in by_size.items() if size >= 3]


def _has_distinct_corners(stack: Polygon) -> NDArray[np.bool_]:
    distinct = np.ones(len(stack), dtype=bool)
    for shift in range(1, stack.shape[1] // 2 + 1):
        distinct &= (stack != np.roll(stack, shift, axis=1)).any(axis=2).all(axis=1)
    return distinct


def _covered(some: Polygon, all_: Polygon, reach: float) -> bool:
    """Whether each of some points is among all, but for the rounding of a transform."""
    from scipy.spatial import KDTree

    if len(some) == 0:
        return True
    distances, _ = KDTree(np.unique(all_, axis=0)).query(np.unique(some, axis=0))
    return bool(distances.max() <= 1e-9 * reach)


def _vector_areas(stack: Polygon) -> Polygon:
    centred = stack - stack[:, :1]
    return np.cross(centred, np.roll(centred, -1, axis=1)).sum(axis=1) / 2


def _volumes(stack: Polygon) -> Polygon:
    return (_vector_areas(stack) * stack.mean(axis=1)).sum(axis=1, keepdims=True) / 3


def print_tables(rows: list[Row]) -> None:
    """Print counts by folder and ending, and every bad row."""
    endings = ("ok", "input", "limit", "crash", "timeout", "memory")
    table = Table(title=f"{SECONDS:g} s and {MEMORY >> 20} MiB each")
    table.add_column("folder")
    for title in ("files", *endings, "compared", "written", "bad", "slowest, s"):
        table.add_column(title, justify="right")
    folders = sorted({_folder(row) for row in rows})
    for folder in [*folders, "all"]:
        part = [row for row in rows if folder in ("all", _folder(row))]
        counts = Counter(row.ending for row in part)
        table.add_row(
            folder,
            str(len(part)),
            *(str(counts[ending]) for ending in endings),
            str(sum(row.compared for row in part)),
            str(sum(row.written == "moved" for row in part)),
            str(sum(bool(row.faults) for row in part)),
            f"{max(row.seconds for row in part):.2f}",
        )
    console = Console(width=None if sys.stdout.isatty() else 140)
    console.print(table)
    for row in rows:
        for fault in row.faults:
            console.print(f"{row.file}: {fault} {row.said}", highlight=False, markup=False)


def _folder(row: Row) -> str:
    return "/".join(row.file.split("/")[:2])


def main() -> int:
    """Run all files, print the table, and say by the exit code whether all went well."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--data", type=Path, required=True, help="directory of the files")
    parser.add_argument("--json", type=Path, help="file to write the rows to")
    parser.add_argument("--only", default="", help="take only files whose path contains this")
    arguments = parser.parse_args()
    files = [
        path
        for folder in FOLDERS
        for path in sorted((arguments.data / folder).rglob("*"))
        if path.is_file() and arguments.only in str(path)
    ]
    rows = []
    for path in files:
        rows.append(run(path, path.relative_to(arguments.data).as_posix()))
        if sys.stderr.isatty():
            print(f"{rows[-1].file}: {rows[-1].ending}", file=sys.stderr)
    if not rows:
        print("no files", file=sys.stderr)
        return 1
    print_tables(rows)
    if arguments.json:
        text = json.dumps([asdict(row) for row in rows], indent=2) + "\n"
        arguments.json.write_text(text, encoding="utf-8")
    return int(any(row.faults for row in rows))


if __name__ == "__main__":
    sys.exit(main())
