"""``meshcone measure``: the metrics alone."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from meshcone.local_files import read_local
from service.cli.arguments import Assignments, Reference, Source, options_from

if TYPE_CHECKING:
    from meshcone.report.report import MeasureReport

_AGREEMENT = {
    "indistinguishable": "the surface lies on the reference, as closely as files store positions",
    "different": "the surface does not lie on the reference",
}


def command(
    source: Source,
    reference: Reference,
    as_json: Annotated[bool, typer.Option("--json", help="Print the whole report.")] = False,
    assignments: Assignments = None,
) -> None:
    """Measure SOURCE against REFERENCE; nothing is moved."""
    options = options_from(assignments)
    source_file, reference_file = read_local(source), read_local(reference)

    from meshcone.verbs.measure import measure  # heavy, not to be paid for a mistyped name

    report = measure(source_file, reference_file, options)
    if as_json:
        typer.echo(report.model_dump_json(indent=2))
    else:
        _print_table(report)


def _print_table(report: MeasureReport) -> None:
    from rich.console import Console

    from service.cli.metrics_table import metrics_table

    document = report.model_dump(mode="json")
    sampling = document["quality"]["conventions"]
    console = Console(soft_wrap=True, highlight=False)
    console.print(metrics_table(document))
    radius = f"radius         {report.frame.radius:.6g} in the unit of the files"
    seeds = sampling["metrics"]["chamfer"]
    lines = [
        radius,
        f"sampling       {seeds['samples']:,} points each, {sampling['sampling']}, "
        f"seeds {seeds['seed']} and {seeds['reference_seed']}",
        f"outcome        {report.outcome}: {_AGREEMENT[report.outcome]}",
        *(f"warning        {warning}" for warning in report.warnings),
    ]
    for line in lines:
        console.print(line, markup=False)
