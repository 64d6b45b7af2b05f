"""Which gates a command is to hold assets against."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from meshcone.errors import InputError
from meshcone.local_files import read_bytes

if TYPE_CHECKING:
    from meshcone.gates.files import GateFile
    from meshcone.gates.rules import GateRule, GateTable
    from meshcone.options import Mode

Gates = Annotated[
    Path | None, typer.Option(help="Gates to pass, as TOML or JSON.", show_default=False)
]
Profile = Annotated[
    str | None,
    typer.Option(
        metavar="NAME",
        help="Gates for a common use: web, 3d-commerce, mobile, vr or print.",
        show_default=False,
    ),
]
Schema = Annotated[
    Path | None,
    typer.Option(help="Schema of Khronos' glTF Asset Auditor, as gates.", show_default=False),
]
Product = Annotated[
    Path | None,
    typer.Option(help="Dimensions of the product, for --schema, as JSON.", show_default=False),
]
Keep = Annotated[
    str | None,
    typer.Option(
        metavar="NAMES",
        help="What must not differ from the reference: uvs, materials, textures, animations, "
        "hierarchy, normals, with commas between them, or all.",
        show_default=False,
    ),
]


@dataclass(frozen=True)
class GateChoice:
    """Where gates come from; those of a later one replace those of the same name."""

    profile: str | None = None
    schema: Path | None = None
    product: Path | None = None
    keep: str | None = None
    gates: Path | None = None

    def files(self) -> list[Path]:
        """What is read for it."""
        return [path for path in (self.gates, self.schema, self.product) if path is not None]

    def read(self, mode: Mode) -> GateFile | None:
        """The gates, for work of this mode; None if there are none.

        Raises:
            InputError: a file or a profile cannot be used.
        """
        from meshcone.gates.auditor import gates_of_schema
        from meshcone.gates.files import parse_gate_file, parse_gates, profile_gates
        from meshcone.gates.keep import keep_gates

        if self.product is not None and self.schema is None:
            raise InputError("--product needs --schema")
        found = None
        if self.profile is not None:
            found = profile_gates(self.profile, mode)
        if self.schema is not None:
            product = None if self.product is None else _named(self.product)
            schema = gates_of_schema(_named(self.schema), product, mode)
            found = schema if found is None else schema.over(found)
        if self.keep is not None:
            names = [name.strip() for name in self.keep.split(",")]
            kept = parse_gates({"gates": _as_document(keep_gates(names))}, mode)
            found = kept if found is None else kept.over(found)
        if self.gates is not None:
            found = parse_gate_file(*_named(self.gates), mode, found)
        return found

    def for_file(self, asset: Path, mode: Mode) -> dict[str, GateRule]:
        """The gates that one file has to pass; none where none were chosen.

        Raises:
            InputError: as :meth:`read`, or a gate has no bound for the file's level of detail.
        """
        from meshcone.gates.levels import level_of
        from meshcone.text import as_text

        found = self.read(mode)
        name = as_text(asset.as_posix())
        return {} if found is None else dict(found.for_asset(name, level_of(name)))


def _as_document(table: GateTable) -> dict[str, dict[str, Any]]:
    return {key: rule.model_dump(exclude_defaults=True) for key, rule in table.items()}


def _named(path: Path) -> tuple[str, bytes]:
    return path.name, read_bytes(path)
