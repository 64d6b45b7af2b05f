"""Real files, degraded and refined against their originals, in both formulations.

    python benchmarks/round_trip.py --data DIR [--every] [--json FILE] [--only NAME]

DIR holds ``objects/`` with OBJ files and ``gltf/`` with glTF and GLB files, as listed below.
Each is copied with seeded noise on its vertices and refined against itself. A row is ok if
the refined file has the degraded one's faces, raw vertices and texture coordinates, opens no
seam, and lies where the original lies, in its units. Exit code 1 if any row is not ok.

With --every it takes all files below DIR that can be refined and have at most 100,000 faces, with
the surface program. "strays" is how far the vertex that ends farthest from where it belongs is
from there, over the largest noise on any; "max" is the largest distance to the surface, over the
input's. Files with the same bytes are taken once.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import median

import numpy as np
from rich.console import Console
from rich.table import Table
from stored import read_stored

from meshcone.assets import Asset, WritePolicy, read_asset
from meshcone.errors import MeshConeError
from meshcone.files import MeshFile
from meshcone.local_files import read_local
from meshcone.options import Formulation, Options
from meshcone.surface import Frame, Mesh
from meshcone.verbs.refine import Refinement, refine

FILES = (
    "objects/airplane__gso.obj",
    "objects/book__gso.obj",  # thin
    "objects/bottle_fuze__trimesh.obj",  # vt and vn
    "objects/cad_bracket__trimesh.obj",  # coarse, sharp, every corner repeated
    "objects/chair__trimesh.obj",  # parts that touch
    "objects/flowerpot__gso.obj",
    "objects/mug__gso.obj",
    "objects/robot_segment__assimp.obj",  # quads, vn, inner walls
    "objects/tablet__gso.obj",
    "objects/teapot__gso.obj",
    "gltf/assimp_glTF2/AnimatedMorphSphere/glTF/AnimatedMorphSphere.gltf",  # morph targets
    "gltf/assimp_glTF2/BoxTextured-glTF-Embedded/BoxTextured.gltf",  # data URI, interleaved
    "gltf/gltftransform/Parrot.glb",  # interleaved
    "gltf/gltftransform/cli/chr_knight.glb",  # seams at most edges
    "gltf/gltftransform/core/BoxTextured_glTF/BoxTextured.gltf",  # buffer in a file of its own
    "gltf/trimesh/boolean.glb",  # 28 meshes
    "gltf/trimesh/mode5.gltf",  # triangle strips under placed nodes
    "gltf/trimesh/nested.glb",  # nodes in nodes
    "gltf/trimesh/simple_pole.glb",  # interleaved, placed nodes
    "gltf/trimesh/testplate.glb",
)
FORMULATIONS: tuple[Formulation, ...] = ("surface", "centroid")
NOISE = 0.015  # standard deviation on each coordinate, in radii of the original
SEED = 20
SUFFIXES = (".obj", ".gltf", ".glb", ".ply", ".stl", ".off")
MOST_FACES = 100_000  # of a file that is found, not listed
FAR = 2.0  # times the largest noise: a vertex that strays farther was led astray
PLACE_TOLERANCE = 0.1  # radii; several times the noise, far below any error of units or place


@dataclass(frozen=True)
class Row:
    """One refinement of one file.

    Attributes:
        input, refined: mean point-to-surface distance to the original, in radii.
        strays: largest distance of a vertex from where it belongs, over the largest noise.
        grown: largest point-to-surface distance over the input's.
        faults: what was found wrong; empty if the row is ok.
    """

    file: str
    formulation: Formulation
    vertices: int
    faces: int
    input: float | None
    refined: float | None
    strays: float | None
    grown: float | None
    outcome: str | None
    seconds: float
    faults: tuple[str, ...]


def degraded(original: MeshFile) -> MeshFile:
    """A copy of a file whose vertices carry noise."""
    asset = read_asset(original.name, original.data, original.resources)
    radius = Frame.of(Mesh(asset.vertices, asset.faces)).radius
    noise = np.random.default_rng(SEED).normal(scale=NOISE * radius, size=asset.vertices.shape)
    # The normals stay the original's: noise belongs in the shape alone.
    data = asset.patched(asset.vertices + noise, WritePolicy(normals="keep", instances="split"))
    return MeshFile(original.name, data, original.resources)


def run(path: Path, name: str, formulation: Formulation) -> Row:
    """Refine a degraded copy of a file against the file, and look at what came out."""
    original = read_local(path)
    source = degraded(original)
    asset = read_asset(source.name, source.data, source.resources)
    options = Options(formulation=formulation)
    start = time.perf_counter()
    refinement: Refinement | None = None
    try:
        refinement = refine(source, original, options)
        faults = tuple(faults_of(refinement.data, source, original))
    except MeshConeError as error:
        faults = (f"{error.kind}: {error}",)
    report = refinement.report if refinement else None
    refined = report.quality.refined if report else None
    noisy = report.quality.input.point_to_surface.max if report else None
    return Row(
        file=name,
        formulation=formulation,
        vertices=asset.counts().vertices,
        faces=asset.counts().faces,
        input=report.quality.input.point_to_surface.mean if report else None,
        refined=refined.point_to_surface.mean if refined else None,
        strays=_strays(refinement.data, source, original) if refinement else None,
        grown=refined.point_to_surface.max / noisy if refined and noisy else None,
        outcome=report.outcome if report else None,
        seconds=time.perf_counter() - start,
        faults=faults,
    )


def _strays(refined: bytes, source: MeshFile, original: MeshFile) -> float | None:
    """How far a vertex ends from where it belongs, at most, over the largest noise on any."""
    files = (refined, source.data, original.data)
    after, before, home = (
        read_asset(original.name, data, original.resources).vertices for data in files
    )
    if not len(after) == len(before) == len(home):
        return None  # a mesh that was drawn twice was copied, and its vertices with it
    moved = [float(np.linalg.norm(each - home, axis=1).max()) for each in (after, before)]
    return moved[0] / moved[1] if moved[1] else None


def found(directory: Path) -> Iterator[str]:
    """Files below a directory that can be refined, by their paths in it, each content once."""
    seen = set()
    for path in sorted(directory.rglob("*")):
        if path.suffix.lower() not in SUFFIXES or not path.is_file():
            continue
        content = hashlib.sha256(path.read_bytes()).digest()
        if content in seen:
            continue
        seen.add(content)
        try:
            original = read_local(path)
            asset = read_asset(original.name, original.data, original.resources)
            degraded(original)
        except MeshConeError as error:
            print(f"{path.relative_to(directory)}: {error}", file=sys.stderr)
        else:
            if asset.counts().faces <= MOST_FACES:
                yield str(path.relative_to(directory))


def faults_of(refined: bytes, source: MeshFile, original: MeshFile) -> Iterator[str]:
    """What a refined file has lost of the file it came from."""
    before = read_asset(source.name, source.data, source.resources)
    after = read_asset(source.name, refined, source.resources)
    if len(after.positions) != len(before.positions):
        yield f"{len(after.positions)} vertices instead of {len(before.positions)}"
    if len(after.faces) != len(before.faces):
        yield f"{len(after.faces)} triangles instead of {len(before.faces)}"
    if not np.array_equal(after.weld, before.weld):
        yield "a seam opened or closed"
    offset = box_offset(after, read_asset(original.name, original.data, original.resources))
    if not offset < PLACE_TOLERANCE:
        yield f"bounding box is off by {offset:.3g} radii"
    if not source.name.lower().endswith((".obj", ".gltf", ".glb")):
        return
    # Compared as they are stored: where a polygon is concave, its split into triangles
    # depends on where its corners are.
    stored, kept = (read_stored(data, source.resources) for data in (source.data, refined))
    if kept.faces != stored.faces:
        yield "other faces"
    if kept.texture_coordinates != stored.texture_coordinates:
        yield "other texture coordinates"


def box_offset(asset: Asset, original: Asset) -> float:
    """Largest difference of the bounding boxes' coordinates, in radii of the original."""
    boxes = [np.stack([a.vertices.min(axis=0), a.vertices.max(axis=0)]) for a in (asset, original)]
    radius = Frame.of(Mesh(original.vertices, original.faces)).radius
    return float(np.abs(boxes[0] - boxes[1]).max() / radius)


def print_table(rows: Iterable[Row]) -> None:
    """Print the rows, with what is wrong below."""
    table = Table(title=f"noise {NOISE:g} of the radius; p2s is the mean point-to-surface distance")
    for title in ("file", "formulation"):
        table.add_column(title, overflow="fold")
    for title in ("vertices", "faces", "p2s input", "refined", "ratio", "max", "strays"):
        table.add_column(title, justify="right")
    table.add_column("outcome")
    table.add_column("seconds", justify="right")
    table.add_column("ok")
    for row in rows:
        table.add_row(
            Path(row.file).name,
            row.formulation,
            str(row.vertices),
            str(row.faces),
            _number(row.input),
            _number(row.refined),
            _share(row.refined / row.input if row.refined is not None and row.input else None),
            _share(row.grown),
            _share(row.strays),
            row.outcome or "-",
            f"{row.seconds:.1f}",
            "no" if row.faults else "yes",
        )
    console = Console(width=None if sys.stdout.isatty() else 140)
    console.print(table)
    for row in rows:
        for fault in row.faults:
            console.print(f"{row.file} ({row.formulation}): {fault}", highlight=False)


def print_totals(rows: Sequence[Row]) -> None:
    """Print over all files how close they come, and how many are harmed."""
    compared = [row for row in rows if row.refined is not None and row.input]
    ratios = [row.refined / row.input for row in compared if row.refined and row.input]
    followed = [row.strays for row in rows if row.strays is not None]
    far = [row.file for row in rows if row.strays is not None and row.strays > FAR]
    worse = [row.file for row in rows if row.grown is not None and row.grown > 1]
    outcomes = Counter(row.outcome or "refused" for row in rows)
    console = Console(width=None if sys.stdout.isatty() else 140, highlight=False)
    console.print(f"{len(rows)} files: {dict(outcomes)}")
    console.print(f"mean distance over the input's: median {_share(median(ratios or [np.nan]))}")
    console.print(
        f"farthest vertex over {FAR:g} times as far from home as any noise: "
        f"{len(far)} of {len(followed)}: {', '.join(far) or '-'}"
    )
    console.print(f"largest distance grows: {len(worse)} of {len(compared)}: {', '.join(worse)}")


def _share(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.5f}"


def main() -> int:
    """Run all files, print the table, and say by the exit code whether all went well."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--data", type=Path, required=True, help="directory of the files")
    parser.add_argument("--every", action="store_true", help="all files of the directory")
    parser.add_argument("--json", type=Path, help="file to write the rows to")
    parser.add_argument("--only", default="", help="take only files whose path contains this")
    arguments = parser.parse_args()
    rows = []
    formulations: Sequence[Formulation] = ("surface",) if arguments.every else FORMULATIONS
    for name in found(arguments.data) if arguments.every else FILES:
        if arguments.only in name:
            for formulation in formulations:
                rows.append(run(arguments.data / name, name, formulation))
                print(f"{name} {formulation}: {rows[-1].seconds:.1f} s", file=sys.stderr)
    print_table(rows)
    if arguments.every:
        print_totals(rows)
    if arguments.json:
        text = json.dumps([asdict(row) for row in rows], indent=2) + "\n"
        arguments.json.write_text(text, encoding="utf-8")
    return int(not rows or any(row.faults for row in rows))


if __name__ == "__main__":
    sys.exit(main())
