"""What an audit costs: a body of 100,000 triangles with four textures of 2,048 texels.

    OMP_NUM_THREADS=1 python benchmarks/audit.py [--triangles N] [--profile]

The asset is made here, as GLB: a knot, unwrapped without overlaps, under four materials with a
JPEG each. Printed are the seconds and the peak of memory of one audit in a process that does
nothing else, the same for 3dqa and meshcontract where their programs are on the PATH, and with
--profile where the seconds go. Khronos' validator is left out: it is a program of its own.
"""

from __future__ import annotations

import argparse
import cProfile
import io
import pstats
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from damage_model import Model, Part, Surface
from damage_writing import Style, to_gltf, to_obj
from PIL import Image

_MATERIALS, _TEXELS = 4, 2048
_PEERS = {"3dqa": ["3dqa", "lint"], "meshcontract": ["meshcontract", "check"]}
_CONTRACT = b"version: 1\ngeometry:\n  max_triangles: 1000000\n"
_MEBIBYTE = 1 << 20


def main() -> None:
    """Make the asset and measure."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--triangles", type=int, default=100_000)
    arguments.add_argument("--profile", action="store_true", help="where the seconds go")
    arguments.add_argument("--audit", type=Path, help=argparse.SUPPRESS)  # the process of its own
    given = arguments.parse_args()
    if given.audit is not None:
        _audit(given.audit, profiled=given.profile)
        return
    with tempfile.TemporaryDirectory() as directory:
        model = knot(given.triangles)
        data, beside = to_obj(model)
        files = {"knot.glb": to_gltf(model, Style(binary=True)), "knot.obj": data, **beside}
        files[".meshcontract.yml"] = _CONTRACT
        for name, content in files.items():
            (Path(directory) / name).write_bytes(content)
        for name in ("knot.glb", "knot.obj"):
            path = Path(directory) / name
            print(f"{name}: {len(files[name]) / _MEBIBYTE:.1f} MiB")
            own = [sys.executable, __file__, "--audit", str(path)]
            subprocess.run([*own, *(["--profile"] if given.profile else [])], check=True)
            for peer, command in _PEERS.items():
                _time(peer, [*command, name], Path(directory))


def _audit(path: Path, *, profiled: bool) -> None:
    from meshcone.assets import read_asset
    from meshcone.local_files import read_local
    from meshcone.options import parse_options
    from meshcone.quality.validity import inspect
    from meshcone.report.audits import Audited, audited
    from meshcone.surface import Mesh

    options = parse_options({"mode": "measure"})
    file = read_local(path)
    before, processor = time.perf_counter(), time.process_time()
    profiler = cProfile.Profile()
    if profiled:
        profiler.enable()
    asset = read_asset(file.name, file.data, file.resources)
    mesh = Mesh(asset.vertices, asset.faces)
    validity = inspect(mesh, options.quality.intersection_pairs, collapsed=asset.collapsed)
    found = audited(options, Audited(file, asset, validity), None)
    profiler.disable()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(
        f"  meshcone: {time.perf_counter() - before:.2f} s; processor seconds "
        f"{time.process_time() - processor:.2f}, and of its decoder of images "
        f"{children.ru_utime + children.ru_stime:.2f} s; peak {peak:.0f} MiB; "
        f"{found.asset.source.budget.triangles:,} triangles"
    )
    if profiled:
        out = io.StringIO()
        pstats.Stats(profiler, stream=out).sort_stats("cumulative").print_stats(45)
        print(out.getvalue())


def _time(name: str, command: list[str], directory: Path) -> None:
    if shutil.which(command[0]) is None:
        print(f"  {name}: not on this machine")
        return
    before = _processor_seconds()
    done = subprocess.run(command, cwd=directory, capture_output=True, check=False, timeout=600)
    lines = (done.stdout + done.stderr).decode(errors="replace").strip().splitlines()
    print(
        f"  {name}: processor seconds {_processor_seconds() - before:.2f}, "
        f"exit code {done.returncode}: {lines[-1][:100] if lines else ''}"
    )


def _processor_seconds() -> float:
    """Of all processes that this one has waited for."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def knot(triangles: int) -> Model:
    """A trefoil knot in four lengths, each with a material and texture of its own."""
    around = 100
    along = max(1, round(triangles / (2 * around * _MATERIALS)))
    parts = [_length(number, along, around) for number in range(_MATERIALS)]
    surfaces = [Surface(f"skin {n}", [1.0, 1.0, 1.0, 1.0], base=n) for n in range(_MATERIALS)]
    images: list[bytes | None] = [_photograph(number) for number in range(_MATERIALS)]
    return Model(
        parts, surfaces, images, [], bound=False, animation=None, camera=False, light=False
    )


def _length(number: int, along: int, around: int) -> Part:
    u, v = np.meshgrid(np.linspace(0, 1, along + 1), np.linspace(0, 1, around + 1), indexing="ij")
    way = 2 * np.pi * (number + u.ravel()) / _MATERIALS
    turn = 2 * np.pi * v.ravel()
    centre, tangent = _trefoil(way), _trefoil(way + 1e-4) - _trefoil(way - 1e-4)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    side = np.cross(tangent, [0.0, 0.0, 1.0])
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    normals = np.cos(turn)[:, None] * side + np.sin(turn)[:, None] * np.cross(side, tangent)
    row, column = (each.ravel() for each in np.mgrid[:along, :around])
    first = row * (around + 1) + column
    below = first + around + 1
    faces = np.vstack(
        [np.column_stack([first, first + 1, below + 1]), np.column_stack([first, below + 1, below])]
    )
    uvs = 0.01 + 0.98 * np.column_stack([u.ravel(), v.ravel()])
    return Part(f"length {number}", number, centre + 0.3 * normals, normals, uvs, faces)


def _trefoil(way: np.ndarray) -> np.ndarray:
    return np.column_stack(
        [np.sin(way) + 2 * np.sin(2 * way), np.cos(way) - 2 * np.cos(2 * way), -np.sin(3 * way)]
    )


def _photograph(seed: int) -> bytes:
    """Something as rough as a photograph, as JPEG."""
    random = np.random.default_rng(seed)
    coarse = random.integers(60, 200, (64, 64, 3), dtype=np.uint8)
    smooth = Image.fromarray(coarse).resize((_TEXELS, _TEXELS), Image.Resampling.BICUBIC)
    grain = random.integers(-12, 13, (_TEXELS, _TEXELS, 3))
    out = io.BytesIO()
    pixels = np.clip(np.asarray(smooth) + grain, 0, 255).astype(np.uint8)
    Image.fromarray(pixels).save(out, "JPEG", quality=90)
    return out.getvalue()


if __name__ == "__main__":
    main()
