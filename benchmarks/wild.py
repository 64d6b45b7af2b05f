"""Says which files of some directories ``measure`` and ``refine`` accept, and why not the rest.

    python benchmarks/wild.py DIRECTORY... [--json FILE] [--whole]

Each mesh file is taken as a source in a process of its own, with a bound on time and memory. It is
accepted for measuring if its surface can be read; for refining if it can also be written back with
every vertex moved, and what is written has the vertices where they were moved to. ``--whole`` runs
both verbs instead, against the file itself. Refusals are counted by their message, with what names
one file (numbers, quoted names) left out.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track
from torture import in_child

from meshcone.assets import Asset, read_asset
from meshcone.errors import InputError
from meshcone.local_files import read_local
from meshcone.options import parse_options
from meshcone.verbs.measure import measure
from meshcone.verbs.refine import refine

SUFFIXES = {".obj", ".glb", ".gltf", ".ply", ".stl", ".off", ".xyz", ".zip"}
SUFFIXES |= {".step", ".stp", ".3mf", ".usd", ".usda", ".usdc", ".usdz"}
SECONDS, MEMORY = 120.0, 4 * 1024**3
CLOSE = 1e-4  # of the size: what quantised positions can be off

Refusals = dict[str, list[str]]


def read(path: Path) -> Asset:
    """The file as a source."""
    file = read_local(path)
    asset = read_asset(file.name, file.data, file.resources)
    corners = asset.vertices[asset.faces]
    if not np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]).any():
        raise InputError("every face is without area")
    return asset


def write(path: Path) -> None:
    """The file, moved and read again."""
    asset = read(path)
    policy = asset.policy(parse_options({}))
    asset.ensure_writable(policy)
    size = float(np.ptp(asset.vertices, axis=0).max())
    noise = np.random.default_rng(0).normal(scale=0.01 * size, size=asset.vertices.shape)
    target = asset.vertices + noise
    again = read_asset(path.name, asset.patched(target, policy), read_local(path).resources)
    used = asset.weld >= 0
    off = np.abs(again.positions[used] - target[asset.weld[used]]).max(initial=0.0)
    if not off <= CLOSE * size + 1e-6 * np.abs(target).max():
        raise AssertionError(f"a vertex is {off / size:.2g} of the size off")


def run_measure(path: Path) -> None:
    """The verb itself."""
    file = read_local(path)
    measure(file, file, parse_options({"quality": {"samples": 500, "emd_samples": 50}}))


def run_refine(path: Path) -> None:
    """The verb itself."""
    file = read_local(path)
    options = {"effort": "fast", "quality": {"samples": 500, "emd_samples": 50}}
    refine(file, file, parse_options(options))


def meshes(directories: list[Path]) -> Iterator[Path]:
    """Every mesh file below some directories."""
    for directory in directories:
        for path in sorted(directory.rglob("*")):
            if path.suffix.lower() in SUFFIXES and path.is_file():
                yield path


def kind(message: str) -> str:
    """A message without its file and what else is particular to one."""
    message = message.partition(": ")[2] or message
    return re.sub(r"'[^']*'", "'…'", re.sub(r"\d[\d,.]*", "N", message))[:110]


def main() -> int:
    """Print both tables; 1 if a file ended in anything but acceptance or refusal in words."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("directories", nargs="+", type=Path)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--whole", action="store_true")
    arguments = parser.parse_args()
    verbs = {
        "measure": run_measure if arguments.whole else read,
        "refine": run_refine if arguments.whole else write,
    }
    paths = list(meshes(arguments.directories))
    refused: dict[str, Refusals] = {verb: defaultdict(list) for verb in verbs}
    broken = 0
    for path in track(paths, "files", console=Console(stderr=True)):
        for verb, work in verbs.items():
            ending, found = in_child(lambda: (work(path), "")[1], SECONDS, MEMORY)  # noqa: B023
            if ending != "ok":
                words = str(found) if ending in ("input", "limit") else f"{ending}: {found}"
                broken += ending not in ("input", "limit")
                refused[verb][kind(words)].append(str(path))
    for verb, messages in refused.items():
        count = len(paths) - sum(map(len, messages.values()))
        print(f"{verb}: {count} of {len(paths)} accepted ({count / max(len(paths), 1):.1%})")
        for message, files in sorted(messages.items(), key=lambda item: -len(item[1])):
            print(f"  {len(files):4}  {message}    {Path(files[0]).name}")
    if arguments.json:
        arguments.json.write_text(json.dumps(refused, indent=1))
    return int(broken > 0)


if __name__ == "__main__":
    sys.exit(main())
