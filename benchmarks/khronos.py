"""Every glTF of a directory, refined, before Khronos' validator and a JSON diff.

    npm install --no-save --no-package-lock --prefix DIR gltf-validator
    python benchmarks/khronos.py --data FILES --validator DIR [--json FILE] [--only NAME]
        [--detail GROWTH [--flips parent|chart]]

Each glTF and GLB file below FILES is refined against a smoothly displaced copy of its own
surface, in few rounds; one that is compressed with Draco twice, into plain buffers and into
Draco again. A row is ok if the validator finds no error or warning in the refined file that
the source has not, and if the two documents differ in nothing but what moving vertices
takes. Files that are refused are listed with the reason. Exit code 1 if a row is not ok.

With --detail the surface that is displaced has more faces, and faces of each file are divided. A
row is then ok if faces were added and the validator has no message about the refined file, of any
severity, whose kind it has not about the source.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from gltf_diff import changed_elsewhere, json_changes, kind_of
from rich.console import Console
from rich.table import Table
from stored import document_and_binary

from meshcone.assets import Asset, read_asset
from meshcone.errors import MeshConeError
from meshcone.files import MeshFile
from meshcone.local_files import read_local
from meshcone.options import parse_options
from meshcone.verbs.refine import refine

DISPLACEMENT = 0.02  # of the surface's largest extent
DENSE = 4_000  # faces of a reference that asks for detail, at least
OPTIONS: dict[str, Any] = {
    "effort": "fast",
    "instances": "split",
    "surface": {"fairness": [0.1, 0.01]},
    "solver": {"certify": False},
    "quality": {"samples": 64, "emd_samples": 16, "curvature_samples": 16},
}
DRIVER = Path(__file__).with_name("validate_gltf.js")
SEVERITIES = ("error", "warning", "info", "hint")
FAILING = SEVERITIES[:2]


@dataclass
class Row:
    """One refinement of one file.

    Attributes:
        note: why it was refused; or ``plain``, ``encode`` for one that Draco compresses.
        source, refined: issues by severity and code.
        pointers: members of the document that differ.
        changes: how many of them, by what they are needed for.
        faults: what is wrong; empty if the row is ok.
    """

    file: str
    note: str = ""
    refused: str = ""
    seconds: float = 0.0
    source: dict[str, int] = field(default_factory=dict)
    refined: dict[str, int] = field(default_factory=dict)
    pointers: list[str] = field(default_factory=list)
    changes: dict[str, int] = field(default_factory=dict)
    faults: list[str] = field(default_factory=list)


def run(path: Path, name: str, validator: Path, detail: dict[str, Any]) -> Iterator[Row]:
    """Refine a file, once in each way it can be written; ``detail`` is the option of this name."""
    try:
        source = read_local(path)
        asset = read_asset(source.name, source.data, source.resources)
    except MeshConeError as error:
        yield Row(name, note=str(error), refused=error.kind)
        return
    is_compressed = b"KHR_draco_mesh_compression" in source.data
    ways = ("plain",) if detail else ("plain", "encode")
    for draco in ways if is_compressed else ("",):
        chosen: dict[str, Any] = {"detail": detail}
        if draco == "encode":
            chosen |= {"draco": draco, "instances": "refuse"}
        row = Row(name, note=draco)
        start = time.perf_counter()
        try:
            answer = refine(source, displaced(asset, dense=bool(detail)), _options(chosen))
        except MeshConeError as error:
            row.refused, row.note = error.kind, f"{draco} {error}".strip()
        else:
            before, after = validate(path, answer.data, validator)
            row.source, row.refined = _counted(before), _counted(after)
            if detail:
                made = answer.report.detail
                row.changes = {"new faces": made.faces_after - made.faces_before}
                row.changes |= {"of them swapped": made.swapped} if made.swapped else {}
                row.faults += [f"new: {issue}" for issue in row.refined if issue not in row.source]
                if not made.divided:
                    row.faults.append("no face was divided")
            else:
                compare(row, source, answer.data)
        row.seconds = time.perf_counter() - start
        yield row


def _options(chosen: dict[str, Any]) -> Any:
    return parse_options(OPTIONS | chosen)


def displaced(asset: Asset, *, dense: bool) -> MeshFile:
    """The surface with a wave of two lengths on it, or bent, as an OBJ file.

    Args:
        asset: whose surface.
        dense: bent, with so many faces that the asset's are too few. A box keeps its corners.
    """
    vertices, faces = asset.vertices, asset.faces
    if dense:
        vertices, faces = trimesh.remesh.subdivide(vertices, faces)
        while len(faces) < DENSE:
            vertices, faces = trimesh.remesh.subdivide(vertices, faces)
    extent = np.ptp(vertices, axis=0).max()
    turned = vertices[:, [1, 2, 0]]
    if dense:
        share = (turned - turned.min(axis=0)) / np.ptp(turned, axis=0).clip(1e-9)
        wave = 2 * np.sin(np.pi * share)
    else:
        phase = 2 * np.pi * turned / extent
        wave = np.sin(phase + 0.3) + np.cos(2 * phase)
    moved = vertices + DISPLACEMENT * extent * wave / 2
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in moved]
    lines += [f"f {a} {b} {c}" for a, b, c in faces + 1]
    return MeshFile("displaced.obj", "\n".join(lines).encode())


def compare(row: Row, source: MeshFile, refined: bytes) -> None:
    """Compare a refined file with its source, byte for byte, and what the validator says."""
    documents = [document_and_binary(data)[0] for data in (source.data, refined)]
    pointers = list(json_changes(*documents))
    kinds = {pointer: kind_of(pointer, documents[0]) for pointer in pointers}
    row.pointers = pointers
    row.changes = dict(Counter(kind or "other" for kind in kinds.values()))
    row.faults += [f"changed: {pointer}" for pointer, kind in kinds.items() if kind is None]
    elsewhere = changed_elsewhere(source.data, refined, source.resources)
    row.faults += [f"other bytes: {pointer}" for pointer in elsewhere]
    # A copy of what had an issue has it too; otherwise each issue counts.
    copies = "copies" in row.changes
    for issue, count in row.refined.items():
        known = row.source.get(issue, 0)
        if issue.startswith(FAILING) and (not known or (count > known and not copies)):
            row.faults.append(f"{issue}: {count} instead of {known}")
    if refined == source.data:
        row.faults.append("nothing moved")


def validate(path: Path, refined: bytes, validator: Path) -> list[list[dict[str, Any]]]:
    """Issues of a file, and of its refined version in the same place."""
    with tempfile.TemporaryDirectory() as directory:
        place = Path(directory)
        for resource in path.parent.rglob("*"):
            if resource.is_file() and resource.stat().st_size < 1 << 26:
                target = place / resource.relative_to(path.parent)
                target.parent.mkdir(parents=True, exist_ok=True)
                target.write_bytes(resource.read_bytes())
        written = place / f"refined{path.suffix}"
        written.write_bytes(refined)
        process = subprocess.run(
            ["node", str(DRIVER), str(validator)],
            input=json.dumps([str(place / path.name), str(written)]).encode(),
            capture_output=True,
            check=True,
            timeout=120,
        )
    reports: list[list[dict[str, Any]]] = json.loads(process.stdout)
    return reports


def _counted(issues: list[dict[str, Any]]) -> dict[str, int]:
    return dict(Counter(f"{SEVERITIES[issue['severity']]} {issue['code']}" for issue in issues))


def print_table(rows: list[Row]) -> None:
    """Print what was refined, what was refused, and what is wrong."""
    table = Table(title="issues: errors/warnings/infos found by the validator")
    for title in ("file", "draco"):
        table.add_column(title, overflow="fold")
    for title in ("source", "refined", "new"):
        table.add_column(title, justify="right")
    table.add_column("members of the JSON that differ", overflow="fold")
    table.add_column("seconds", justify="right")
    table.add_column("ok")
    refined = [row for row in rows if not row.refused]
    for row in refined:
        table.add_row(
            row.file,
            row.note,
            _issues(row.source),
            _issues(row.refined),
            str(sum(count for issue, count in row.refined.items() if _is_new(row, issue))),
            ", ".join(f"{count} {kind}" for kind, count in sorted(row.changes.items())),
            f"{row.seconds:.1f}",
            "no" if row.faults else "yes",
        )
    console = Console(width=None if sys.stdout.isatty() else 160)
    console.print(table)
    for row in rows:
        if row.refused:
            console.print(f"{row.file}: {row.refused}: {row.note}", highlight=False, markup=False)
        for fault in row.faults:
            console.print(f"{row.file}: NOT OK: {fault}", highlight=False, markup=False)
    refused = Counter(row.refused for row in rows if row.refused)
    ok = sum(not row.faults for row in refined)
    words = ", ".join(f"{count} {kind}" for kind, count in sorted(refused.items())) or "none"
    console.print(f"refined {len(refined)}, of these ok {ok}; refused: {words}", highlight=False)


def _is_new(row: Row, issue: str) -> bool:
    return issue.startswith(FAILING) and issue not in row.source


def _issues(found: dict[str, int]) -> str:
    return "/".join(
        str(sum(count for issue, count in found.items() if issue.startswith(severity)))
        for severity in SEVERITIES[:3]
    )


def main() -> int:
    """Run all files, print the table, and say by the exit code whether all went well."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--data", type=Path, required=True, help="directory of the files")
    parser.add_argument(
        "--validator", type=Path, required=True, help="directory whose node_modules has it"
    )
    parser.add_argument("--json", type=Path, help="file to write the rows to")
    parser.add_argument("--only", default="", help="take only files whose path contains this")
    parser.add_argument("--detail", type=float, help="times as many faces as a file has")
    parser.add_argument("--flips", default="parent", choices=["none", "parent", "chart"])
    arguments = parser.parse_args()
    detail = {"growth": arguments.detail, "flips": arguments.flips} if arguments.detail else {}
    rows: list[Row] = []
    for path in sorted(arguments.data.rglob("*.gl*")):
        name = path.relative_to(arguments.data).as_posix()
        if path.suffix in {".glb", ".gltf"} and arguments.only in name:
            rows += run(path, name, arguments.validator, detail)
            print(f"{name}: {rows[-1].seconds:.1f} s", file=sys.stderr)
    print_table(rows)
    if arguments.json:
        text = json.dumps([asdict(row) for row in rows], indent=2) + "\n"
        arguments.json.write_text(text, encoding="utf-8")
    return int(not rows or any(row.faults for row in rows))


if __name__ == "__main__":
    sys.exit(main())
