"""``meshcone refine``: the engine, in this process."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from meshcone.errors import InputError
from meshcone.local_files import files_of, read_local
from service.cli.arguments import Assignments, Reference, Source, options_from
from service.cli.output import certificate_path, require_places, write_together
from service.cli.progress_bar import progress_bar

if TYPE_CHECKING:
    from meshcone.verbs.refine import Refinement


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
    options = options_from(assignments, formulation)
    if options.mode != "refine":
        raise InputError("the mode 'measure' is for jobs: use `meshcone measure` here")
    require_places(
        (out, report, report and certificate_path(report), html),
        files_of(source) + files_of(reference),
    )
    if out.suffix.lower() != source.suffix.lower():
        raise InputError(
            f"the refined mesh has the source's format: its name must end in '{source.suffix}'",
            file=str(out),
        )
    source_file, reference_file = read_local(source), read_local(reference)

    from meshcone.verbs.refine import refine  # 2.5 s, not to be paid for a mistyped name

    with progress_bar() as show:
        refinement = refine(source_file, reference_file, options, progress=show)
    contents = {out: refinement.data}
    if report is not None:
        contents[report] = refinement.report.model_dump_json(indent=2).encode() + b"\n"
        if refinement.certificate is not None:
            contents[certificate_path(report)] = refinement.certificate
    if html is not None:
        contents[html] = _page(refinement, out, report)
    write_together(contents)


def _page(refinement: Refinement, out: Path, report: Path | None) -> bytes:
    from meshcone.views.preview import preview_glb
    from service.html_report import ReportedAsset, html_report

    verdict = refinement.report.gates
    asset = ReportedAsset(
        name=f"{refinement.report.inputs.source.name} → {refinement.report.inputs.reference.name}",
        ending=refinement.report.outcome if verdict is None else verdict.verdict,
        report=refinement.report.model_dump_json(),
        preview=preview_glb(refinement.scene),
        refined=out.name,
        report_name=None if report is None else report.name,
    )
    return html_report(asset.name, [asset])
