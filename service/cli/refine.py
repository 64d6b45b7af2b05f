"""``meshcone refine``: the engine, in this process."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from meshcone.errors import InputError
from service.cli.arguments import Assignments, Reference, Source, options_from
from service.cli.progress_bar import progress_bar


def command(
    source: Source,
    reference: Reference,
    out: Annotated[
        Path, typer.Option("-o", "--out", help="Refined mesh to write.", show_default=False)
    ],
    report: Annotated[
        Path | None,
        typer.Option(
            help="Report to write, as JSON, with its certificate beside it.", show_default=False
        ),
    ] = None,
    html: Annotated[
        Path | None,
        typer.Option(
            help="Page to write that shows it all, meshes and proof, in one file.",
            show_default=False,
        ),
    ] = None,
    formulation: Annotated[
        str | None, typer.Option(help="Program to solve: surface or centroid. [default: surface]")
    ] = None,
    assignments: Assignments = None,
) -> None:
    """Refine SOURCE towards REFERENCE."""
    from meshcone.library.functions import refine_loaded
    from meshcone.library.inputs import load_unread
    from meshcone.library.results import require_saveable

    options = options_from(assignments, formulation)
    if options.mode != "refine":
        raise InputError("the mode 'measure' is for jobs: use `meshcone measure` here")
    source_file, reference_file = load_unread(source, "source"), load_unread(reference, "reference")
    source_file = source_file.with_file(options.cones.pin.vertices_file)
    require_saveable(out, report, html, source_file, reference_file)
    with progress_bar() as show:
        refined = refine_loaded(source_file, reference_file, options, progress=show)
    refined.save(out, report=report, html=html)
    for warning in refined.report.warnings:
        typer.echo(f"warning        {warning}", err=True)
