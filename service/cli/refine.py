"""``meshcone refine``: the engine, in this process."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from meshcone.outputs import certificate_path
from service.cli.arguments import Assignments, Per, Reference, Source, options_from
from service.cli.boundary import NOT_REACHED
from service.cli.missed import MISSED_SECTIONS, missed
from service.cli.progress_bar import progress_bar
from service.cli.telling import tell


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
            help="HTML page to write, with meshes and proof in one file.",
            show_default=False,
        ),
    ] = None,
    formulation: Annotated[
        str | None, typer.Option(help="Program to solve: surface or centroid. [default: surface]")
    ] = None,
    within: Annotated[
        str | None,
        typer.Option(
            help="Tolerance to reach and to prove: 0.5 or 0.5mm in the unit of the files, or "
            "0.2% of the radius. A glTF is in metres, and 5mm is 0.005 of them. Exits with 1 where "
            "it is not reached.",
            show_default=False,
        ),
    ] = None,
    detail: Annotated[
        str | None,
        typer.Option(
            help="Faces to add where SOURCE has too few: 4x for four times as many as it has at "
            "most, 20000 for so many in all, auto for what --within takes.",
            show_default=False,
        ),
    ] = None,
    processes: Annotated[
        int,
        typer.Option(
            min=1,
            max=1024,
            help="Regions of SOURCE to solve at once, where --set surface.regions divides it. "
            "What is written is the same for any number.",
        ),
    ] = 1,
    quiet: Annotated[
        bool, typer.Option("-q", "--quiet", help="Print warnings and errors only.")
    ] = False,
    per: Per = None,
    assignments: Assignments = None,
) -> int:
    """Move SOURCE onto REFERENCE, and prove how close it comes.

    Only vertices move. Faces, texture coordinates, materials and nodes stay as they are. It exits
    with 1 if the tolerance is not reached or a gate, set by --set gates=…, is not passed.
    """
    from meshcone.library.functions import refine_loaded
    from meshcone.library.inputs import load_unread
    from meshcone.library.results import require_saveable

    options = options_from(assignments, formulation, per, within, detail, mode="refine")
    source_file, reference_file = load_unread(source, "source"), load_unread(reference, "reference")
    source_file = source_file.with_file(options.cones.pin.vertices_file)
    require_saveable(out, report, html, source_file, reference_file)
    with progress_bar() as show:
        refined = refine_loaded(
            source_file, reference_file, options, progress=show, processes=processes
        )
    left = refined.write(out, report=report, html=html)
    done = refined.report
    if done.statement is not None and not quiet:
        tell(done.statement)
    for warning in [*done.warnings, *([left] if left else [])]:
        tell(f"warning        {warning}", err=True)
    short = missed(done.model_dump(mode="json", include=set(MISSED_SECTIONS)))
    for line in short.lines:
        tell(line, err=True)
    code = NOT_REACHED if short.failed else 0
    if quiet:
        return code
    beside = [report] if report is not None else []
    if report is not None and refined.certificate is not None:
        beside.append(certificate_path(report))
    _show(done.model_dump(mode="json"), [out, *beside, *([html] if html else [])])
    return code


def _show(report: Mapping[str, Any], written: Iterable[Path]) -> None:
    from service.cli.summary import kept_words, outcome_line

    quality, certificate = report["quality"], report["certificate"]
    scores = [quality[name]["point_to_surface"] for name in ("input", "refined")]
    mean, worst = (" → ".join(f"{each[name]:.3g}" for each in scores) for name in ("mean", "max"))
    proof = kept_words(report)
    if certificate is not None:
        proof = "holds" if certificate["holds"] else "does not hold"
    tell(outcome_line(report))
    if report["detail"] is not None:
        found = report["detail"]
        words = f"{found['faces_before']:,} → {found['faces_after']:,} faces"
        tell(f"detail         {words}, in {found['levels']} levels; {found['stopped']}")
    tell(f"deviation      mean {mean}, worst vertex {worst}, as shares of the radius")
    if quality["per"] is not None:
        from rich.console import Console

        from service.cli.parts_table import parts_table

        Console(soft_wrap=True, highlight=False).print(parts_table(quality["per"]))
    tell(f"certificate    {proof}")
    tell(f"files          {', '.join(map(str, written))}")
