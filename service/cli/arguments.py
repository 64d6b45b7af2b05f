"""Arguments that more than one command takes."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from meshcone.errors import InputError
from meshcone.options import Mode, Options, parse_assignments, parse_options
from meshcone.options.detail import DetailOptions

Source = Annotated[
    Path,
    typer.Argument(
        metavar="SOURCE",
        help="The mesh: .obj, .glb, .gltf, .ply, .stl or .off, or a .zip with one; to be measured, "
        ".step, .3mf or .usd too.",
        show_default=False,
    ),
]
Reference = Annotated[
    Path,
    typer.Argument(metavar="REFERENCE", help="The mesh it should have been.", show_default=False),
]
Assignments = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="Set an option, such as surface.edge_cap=2.5; can be repeated.",
        show_default=False,
    ),
]

Per = Annotated[
    str | None,
    typer.Option(
        "--per",
        metavar="KIND",
        help="Distances of each part too: node, mesh, material or group.",
        show_default=False,
    ),
]


def options_from(
    assignments: list[str] | None,
    formulation: str | None = None,
    per: str | None = None,
    within: str | None = None,
    detail: str | None = None,
    mode: Mode | None = None,
) -> Options:
    """The options that ``--set`` and the other arguments here ask for.

    Args:
        assignments: of ``--set``.
        formulation: of ``--formulation``.
        per: of ``--per``.
        within: of ``--within``.
        detail: of ``--detail``.
        mode: of the command, if it has one of its own.

    Raises:
        InputError: one of them does not exist or is out of range, or the mode is another
            command's.
    """
    document = parse_assignments(assignments or ())
    if mode is not None:
        document.setdefault("mode", mode)
    if formulation is not None:
        document["formulation"] = formulation
    if within is not None:
        document["within"] = within
    if detail is not None:
        asked = DetailOptions.asked(detail)
        if detail.strip() == "auto" and "within" not in document:
            raise InputError("--detail auto needs a tolerance to reach: add --within")
        document["detail"] = {**_section(document, "detail", "growth=4"), **asked}
    if per is not None:
        document["quality"] = {**_section(document, "quality", "per=node"), "per": per}
    options = parse_options(document)
    if mode is not None and options.mode != mode:
        raise InputError(
            f"the mode '{options.mode}' is not this command's: use `meshcone {options.mode}`"
        )
    return options


def _section(document: Mapping[str, Any], name: str, example: str) -> Mapping[str, Any]:
    """What ``--set`` gives of a section that another argument adds to."""
    section = document.get(name, {})
    if not isinstance(section, dict):
        raise InputError(
            f"option '{name}': expected options in it, such as --set {name}.{example}, "
            f"found {json.dumps(section)[:40]}"
        )
    return section
