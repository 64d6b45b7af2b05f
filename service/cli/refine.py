"""``meshcone refine``: the engine, in this process."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from meshcone.errors import InputError
from service.cli.arguments import Assignments, Reference, Source, options_from
from service.cli.local_files import read_local
from service.cli.output import certificate_path, require_writable, write_together
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
    formulation: Annotated[
        str | None, typer.Option(help="Program to solve: surface or centroid. [default: surface]")
    ] = None,
    assignments: Assignments = None,
) -> None:
    """Refine SOURCE towards REFERENCE."""
    options = options_from(assignments, formulation)
    if options.mode != "refine":
        raise InputError("the mode 'measure' is for jobs: use `meshcone measure` here")
    for path in (out, report):
        if path is not None:
            require_writable(path)
    if report is not None:
        require_writable(certificate_path(report))
    if out.suffix.lower() != source.suffix.lower():
        raise InputError(
            f"the refined mesh has the source's format: its name must end in '{source.suffix}'",
            file=str(out),
        )
    source_file, reference_file = read_local(source), read_local(reference)

    from meshcone.refine import refine  # 2.5 s, not to be paid for a mistyped name

    with progress_bar() as show:
        refinement = refine(source_file, reference_file, options, progress=show)
    contents = {out: refinement.data}
    if report is not None:
        contents[report] = refinement.report.model_dump_json(indent=2).encode() + b"\n"
        if refinement.certificate is not None:
            contents[certificate_path(report)] = refinement.certificate
    write_together(contents)
