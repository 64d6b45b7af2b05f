"""Which ways to damage an asset the gates of the documentation notice, and which exports pass.

    python benchmarks/damage.py [--only WORD ...] [--json FILE]

An asset that has everything is damaged in every way named below, as glTF and as OBJ where that
can hold what is damaged, and held against itself undamaged: by the example gates of docs/gates.md,
by `--keep all`, and by the profile for 3D commerce. A cell names the first check that fails. Exits
with 1 if a damage passes all three, or an undamaged export fails one of them.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from importlib import import_module
from pathlib import Path

from damage_model import Model, whole_model
from damage_register import BOTH, DAMAGES
from damage_writing import Style, to_gltf, to_obj
from rich.console import Console
from rich.table import Table

from meshcone.files import MeshFile
from meshcone.gates.files import GateFile, parse_gate_file
from meshcone.gates.judge import judge
from meshcone.gates.keep import keep_gates
from meshcone.gates.profile import profile
from meshcone.gates.rules import GateTable
from meshcone.options import parse_options
from meshcone.report.report import MeasureReport
from meshcone.verbs.measure import measure

_DOCS = Path(__file__).parents[1] / "docs" / "gates.md"
_OPTIONS = {"quality": {"samples": 2000, "emd_samples": 16, "curvature_samples": 16}}

EXPORTS: dict[str, Style | str] = {
    "the same again": Style(),
    "GLB": Style(binary=True),
    "other order of vertices and faces": Style(shuffled=True),
    "other layout of the buffer": Style(reverse=True),
    "16-bit indices": Style(wide=False),
    "quantised": Style(quantised=True),
    "all of it": Style(binary=True, wide=False, reverse=True, shuffled=True, quantised=True),
    "OBJ again": "obj",
}


@dataclass(frozen=True)
class Row:
    """What the gates say of one file.

    Attributes:
        name: of the damage, or of the export.
        format: of the file.
        harmed: whether it was damaged.
        caught: for each set of gates, what it noticed first, if anything.
    """

    name: str
    format: str
    harmed: bool
    caught: dict[str, str | None]

    @property
    def is_right(self) -> bool:
        """Whether a damage was noticed, or an export let through by what should let it through."""
        if self.harmed:
            return any(self.caught.values())
        return not any(self.caught.values())


def gate_sets() -> dict[str, GateTable]:
    """The gates of each column."""
    example = re.findall(r"^```toml\n(.*?)^```", _DOCS.read_text(), re.M | re.S)[0]
    files: dict[str, GateFile] = {
        "docs": parse_gate_file("docs.toml", example.encode(), "measure"),
        "3d-commerce": parse_gate_file("3d.toml", profile("3d-commerce"), "measure"),
    }
    tables = {name: file.for_asset("pot.glb") for name, file in files.items()}
    return {**tables, "keep all": keep_gates(["all"])}


def rows(only: Sequence[str] = ()) -> Iterator[Row]:
    """Damage, export and judge: all, or what has one of these words in its name."""
    sets = gate_sets()
    gates = {key: rule for table in sets.values() for key, rule in table.items()}
    # One report for all of them; Khronos' validator, a process for each file, says nothing new.
    asked = {
        key: rule.model_dump(exclude_none=True)
        for key, rule in gates.items()
        if ".validator." not in key
    }
    options = parse_options({**_OPTIONS, "mode": "measure", "gates": asked})
    for module in ("damage_surface", "damage_contents"):
        import_module(module)  # which enters its damages
    references = {name: _written(whole_model(), name) for name in BOTH}

    def wanted(name: str) -> bool:
        return not only or any(word in name for word in only)

    def judged(name: str, kind: str, file: MeshFile, *, harmed: bool) -> Row:
        report = measure(file, references[kind], options)
        caught = {each: _first(report, table) for each, table in sets.items()}
        return Row(name, kind, harmed, caught)

    for name, (function, formats) in DAMAGES.items():
        for kind in formats:
            if wanted(name):
                model = whole_model()
                function(model)
                yield judged(name, kind, _written(model, kind), harmed=True)
    for name, style in EXPORTS.items():
        if wanted(name):
            kind = "gltf" if isinstance(style, Style) else style
            yield judged(name, kind, _written(whole_model(), kind, style), harmed=False)


def _written(model: Model, kind: str, style: Style | str | None = None) -> MeshFile:
    if kind == "obj":
        data, beside = to_obj(model)
        return MeshFile("pot.obj", data, beside)
    style = style if isinstance(style, Style) else Style()
    return MeshFile(f"pot.{'glb' if style.binary else 'gltf'}", to_gltf(model, style))


def _first(report: MeasureReport, gates: GateTable) -> str | None:
    bad = [
        check
        for check in judge(report, gates).checks
        if check.status != "pass" and check.severity == "error"
    ]
    return f"{bad[0].key} {bad[0].status}" if bad else None


def main() -> int:
    """Print the table; 1 if a row is wrong."""
    arguments = argparse.ArgumentParser(description=__doc__)
    arguments.add_argument("--only", nargs="*", default=[], help="words in their names")
    arguments.add_argument("--json", type=Path, help="file for the rows")
    given = arguments.parse_args()
    found = list(rows(given.only))
    table = Table("damage", "format", *found[0].caught)
    for row in found:
        style = None if row.is_right else "bold red"
        cells = [value or "-" for value in row.caught.values()]
        table.add_row(row.name, row.format, *cells, style=style)
    Console(width=180).print(table)
    harmed = [row for row in found if row.harmed]
    for name in found[0].caught:
        caught = sum(row.caught[name] is not None for row in harmed)
        passed = sum(row.caught[name] is None for row in found if not row.harmed)
        exports = len(found) - len(harmed)
        print(f"{name}: {caught} of {len(harmed)} damages noticed, {passed}/{exports} passed")
    if given.json is not None:
        given.json.write_text(json.dumps(list(map(asdict, found)), indent=1) + "\n")
    return int(not all(row.is_right for row in found))


if __name__ == "__main__":
    sys.exit(main())
