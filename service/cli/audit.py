"""``meshcone audit``: what a whole asset is, and what changed against its reference."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from pydantic import BaseModel

from meshcone.errors import InputError
from meshcone.local_files import files_of, read_local
from meshcone.outputs import require_places, write_together
from service.cli.arguments import Assignments, options_from
from service.cli.gate_choice import GateChoice, Gates, Keep, Product, Profile, Schema
from service.cli.telling import tell

if TYPE_CHECKING:
    from meshcone.auditing.records import AssetAudit, Changes
    from meshcone.report.report import AuditReport

_NOT_PASSED = 1  # exit code
_ROWS_SHOWN = 20  # of what changed


def command(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The asset.", show_default=False)],
    reference: Annotated[
        Path | None,
        typer.Option(help="The reference: the asset that it should match.", show_default=False),
    ] = None,
    gates: Gates = None,
    profile: Profile = None,
    schema: Schema = None,
    product: Product = None,
    keep: Keep = None,
    report: Annotated[
        Path | None, typer.Option(help="Report to write, as JSON.", show_default=False)
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the whole report.")] = False,
    assignments: Assignments = None,
) -> int:
    """Check FILE as a whole asset, not only its surface.

    Budget, size, geometry, texture coordinates, images, materials and animation are checked. With
    --reference the command also says what changed. It exits with 0 if the asset passes its gates or
    has none, 1 if it fails or could not be tested, 2 if a file cannot be used, 3 after a fault of
    MeshCone's own.
    """
    choice = GateChoice(profile, schema, product, keep, gates)
    inputs = [file, *([] if reference is None else [reference]), *choice.files()]
    require_places([report], [each for path in inputs for each in files_of(path)])
    options = options_from(assignments, mode="audit")
    if "gates" in options.model_fields_set:
        raise InputError("'gates' are set by --gates here")
    options = options.model_copy(update={"gates": choice.for_file(file, "audit")})
    source_file = read_local(file)
    reference_file = None if reference is None else read_local(reference)

    from meshcone.verbs.audit import audit  # heavy, not to be paid for a mistyped name

    done = audit(source_file, reference_file, options)
    if report is not None:
        write_together({report: done.model_dump_json(indent=2).encode() + b"\n"})
    if as_json:
        typer.echo(done.model_dump_json(indent=2))
    else:
        for line in _lines(done):
            tell(line)
    passed = done.gates is None or done.gates.verdict == "pass"
    return 0 if passed else _NOT_PASSED


def _lines(report: AuditReport) -> Iterator[str]:
    from meshcone.gates.words import label

    asset = report.asset
    yield from _values(asset.source)
    if report.changes is not None:
        yield from _changes(report.changes)
    for warning in report.warnings:
        yield f"{'warning':<11} {warning}"
    for check in report.gates.checks if report.gates is not None else ():
        yield f"{label(check.status, check.severity):<11} {check.words}"


def _values(asset: AssetAudit) -> Iterator[str]:
    """A line for each family: its values under the names that gates use, without what is 0."""
    for family in type(asset).model_fields:
        record: BaseModel = getattr(asset, family)
        told = [
            f"{name} {_written(value)}"
            for name in type(record).model_fields
            if _is_told(value := getattr(record, name))
        ]
        yield f"{family:<11} {', '.join(told) or 'nothing'}"


def _is_told(value: object) -> bool:
    return isinstance(value, str | float) or (isinstance(value, int) and bool(value))


def _written(value: object) -> str:
    if isinstance(value, bool):
        return "yes"
    if isinstance(value, str):
        return f"'{value}'"
    return f"{value:,}" if isinstance(value, int) else f"{value:.4g}"


def _changes(changes: Changes) -> Iterator[str]:
    for row in changes.rows[:_ROWS_SHOWN]:
        yield f"{row.kind:<11} {row.words}"
    if changes.altered.materials is None or changes.lost.images is None:
        yield f"{'not tested':<11} images or materials that were sent with neither file"
    counts = (changes.lost, changes.added, changes.renamed, changes.moved, changes.altered)
    more = sum(count or 0 for each in counts for count in dict(each).values()) - _ROWS_SHOWN
    if more > 0:
        yield f"{'':<11} and {more:,} more: --json lists them"
