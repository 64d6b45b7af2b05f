"""``meshcone refine``: the engine, in this process."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from meshcone.errors import InputError
from meshcone.outputs import certificate_path
from service.cli.arguments import Assignments, Per, Reference, Source, options_from
from service.cli.progress_bar import progress_bar

if TYPE_CHECKING:
    from meshcone.report.report import Report

_NOT_REACHED = 1
_PLACES = 5
_GATE = "deviation.max"


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
    within: Annotated[
        str | None,
        typer.Option(
            help="Tolerance to reach and to prove: 0.5 or 0.5mm in the unit of the files, or "
            "0.2% of the radius. A glTF is in metres, and 5mm is 0.005 of them. Exits with 1 where "
            "it is not reached.",
            show_default=False,
        ),
    ] = None,
    quiet: Annotated[
        bool, typer.Option("-q", "--quiet", help="Say nothing of what came of it.")
    ] = False,
    per: Per = None,
    assignments: Assignments = None,
) -> int:
    """Refine SOURCE towards REFERENCE."""
    from meshcone.library.functions import refine_loaded, refine_loaded_within
    from meshcone.library.inputs import load_unread
    from meshcone.library.results import require_saveable

    options = options_from(assignments, formulation, per)
    if options.mode != "refine":
        raise InputError(
            f"the mode '{options.mode}' is for jobs: use `meshcone {options.mode}` here"
        )
    source_file, reference_file = load_unread(source, "source"), load_unread(reference, "reference")
    source_file = source_file.with_file(options.cones.pin.vertices_file)
    require_saveable(out, report, html, source_file, reference_file)
    promise = None
    with progress_bar() as show:
        if within is None:
            refined = refine_loaded(source_file, reference_file, options, progress=show)
        else:
            refined, promise = refine_loaded_within(
                source_file, reference_file, options, within, progress=show
            )
    refined.save(out, report=report, html=html)
    for warning in refined.report.warnings:
        typer.echo(f"warning        {warning}", err=True)
    reached = promise is None or promise.kept
    if promise is not None and not promise.kept:
        for line in _missed(refined.report, within or "", promise.attempts):
            typer.echo(line, err=True)
    if quiet:
        return 0 if reached else _NOT_REACHED
    beside = [report] if report is not None else []
    if report is not None and refined.certificate is not None:
        beside.append(certificate_path(report))
    _show(refined.report.model_dump(mode="json"), [out, *beside, *([html] if html else [])])
    return 0 if reached else _NOT_REACHED


def _missed(report: Report, within: str, attempts: int) -> Iterator[str]:
    """That a tolerance was not reached, and where."""
    from meshcone.gates.units import unit_of
    from meshcone.gates.words import number, point

    yield f"not within {within}, after {attempts} refinements; the closest of them was written"
    checks = report.gates.checks if report.gates is not None else ()
    for check in (each for each in checks if each.key == _GATE):
        yield f"reason         {check.words}"
        scale = report.frame.radius if check.bound == "max_model" else 1.0
        beyond = [
            place
            for place in report.quality.worst_points
            if check.limit is not None and scale * place.distance > check.limit
        ]
        unit = report.options.gates[_GATE].unit or unit_of(report.inputs.reference.format)
        for place in beyond[:_PLACES]:
            distance = number(place.distance * report.frame.radius)
            yield f"place          {distance} {unit} off near {point(place.position)}"


def _show(report: Mapping[str, Any], written: Iterable[Path]) -> None:
    from service.demo.summary import kept_words, outcome_line

    quality, certificate = report["quality"], report["certificate"]
    scores = [quality[name]["point_to_surface"] for name in ("input", "refined")]
    mean, worst = (" → ".join(f"{each[name]:.3g}" for each in scores) for name in ("mean", "max"))
    proof = kept_words(report)
    if certificate is not None:
        proof = "holds" if certificate["holds"] else "does not hold"
    if report["statement"] is not None:
        typer.echo(report["statement"])
    typer.echo(outcome_line(report))
    typer.echo(f"deviation      mean {mean}, worst vertex {worst}, as shares of the radius")
    if quality["per"] is not None:
        from rich.console import Console

        from service.cli.parts_table import parts_table

        Console(soft_wrap=True, highlight=False).print(parts_table(quality["per"]))
    typer.echo(f"certificate    {proof}")
    typer.echo(f"files          {', '.join(map(str, written))}")
