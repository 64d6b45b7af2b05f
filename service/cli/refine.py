"""``meshcone refine``: the engine, in this process."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from meshcone.errors import InputError
from meshcone.progress import Progress, ProgressCallback
from service.cli.arguments import Assignments, Reference, Source, options_from
from service.cli.local_files import read_local
from service.cli.output import certificate_path, require_writable, write_together


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

    with _progress_bar() as show:
        refinement = refine(source_file, reference_file, options, progress=show)
    contents = {out: refinement.data}
    if report is not None:
        contents[report] = refinement.report.model_dump_json(indent=2).encode() + b"\n"
        if refinement.certificate is not None:
            contents[certificate_path(report)] = refinement.certificate
    write_together(contents)


@contextmanager
def _progress_bar() -> Iterator[ProgressCallback | None]:
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    console = Console(stderr=True)
    if not console.is_terminal:
        yield None
        return
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Bar(*columns, console=console, transient=True) as bar:
        task = bar.add_task("read", total=1.0)

        def show(progress: Progress) -> None:
            rounds = f" {progress.round}/{progress.rounds}" if progress.stage == "solve" else ""
            bar.update(task, completed=progress.fraction, description=progress.stage + rounds)

        yield show
