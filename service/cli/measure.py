"""``meshcone measure``: the metrics alone."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from meshcone.errors import InputError
from meshcone.local_files import read_local
from service.cli.arguments import Assignments, Per, Reference, Source, options_from
from service.cli.gate_choice import GateChoice, Gates, Keep, Product, Profile, Schema
from service.cli.telling import tell

if TYPE_CHECKING:
    from meshcone.report.report import MeasureReport

_NOT_PASSED = 1  # exit code
_AGREEMENT = {
    "indistinguishable": "the surface lies on the reference, as closely as files store positions",
    "different": "the surface does not lie on the reference",
}


def command(
    source: Source,
    reference: Reference,
    gates: Gates = None,
    profile: Profile = None,
    schema: Schema = None,
    product: Product = None,
    keep: Keep = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the whole report.")] = False,
    per: Per = None,
    assignments: Assignments = None,
) -> int:
    """Measure SOURCE against REFERENCE; nothing is moved.

    The command exits with 0 if the asset passes its gates or has none, 1 if it fails or could not
    be tested, 2 if a file cannot be used, 3 after a fault of MeshCone's own.
    """
    options = options_from(assignments, per=per, mode="measure")
    table = GateChoice(profile, schema, product, keep, gates).for_file(source, "measure")
    if table and options.gates:
        raise InputError("'gates' are set twice, by --set and by a file, profile or schema")
    if table:
        options = options.model_copy(update={"gates": table})
    source_file, reference_file = read_local(source), read_local(reference)

    from meshcone.verbs.measure import measure  # heavy, not to be paid for a mistyped name

    report = measure(source_file, reference_file, options)
    if as_json:
        typer.echo(report.model_dump_json(indent=2))
    else:
        _print_table(report)
    return 0 if report.gates is None or report.gates.verdict == "pass" else _NOT_PASSED


def _print_table(report: MeasureReport) -> None:
    from rich.console import Console

    from meshcone.gates.words import label
    from service.cli.metrics_table import metrics_table
    from service.cli.parts_table import parts_table

    document = report.model_dump(mode="json")
    sampling = document["quality"]["conventions"]
    console = Console(soft_wrap=True, highlight=False)
    if report.statement is not None:
        tell(report.statement)
    console.print(metrics_table(document))
    if document["quality"]["per"] is not None:
        console.print(parts_table(document["quality"]["per"]))
    radius = f"radius         {report.frame.radius:.6g} in the unit of the files"
    seeds = sampling["metrics"]["chamfer"]
    lines = [
        radius,
        f"sampling       {seeds['samples']:,} points each, {sampling['sampling']}, "
        f"seeds {seeds['seed']} and {seeds['reference_seed']}",
        f"outcome        {report.outcome}: {_AGREEMENT[report.outcome]}",
        *(f"warning        {warning}" for warning in report.warnings),
    ]
    if report.gates is not None:
        lines += [
            f"{label(each.status, each.severity):<15}{each.words}" for each in report.gates.checks
        ]
    for line in lines:
        tell(line)
