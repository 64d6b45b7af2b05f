"""``meshcone measure``: the metrics alone."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any

import typer

from service.cli.arguments import Assignments, Reference, Source, options_from
from service.cli.local_files import read_local


def command(
    source: Source,
    reference: Reference,
    as_json: Annotated[bool, typer.Option("--json", help="Print the whole report.")] = False,
    assignments: Assignments = None,
) -> None:
    """Measure SOURCE against REFERENCE; nothing is moved."""
    options = options_from(assignments)
    source_file, reference_file = read_local(source), read_local(reference)

    from meshcone.measure import measure  # heavy, not to be paid for a mistyped name

    report = measure(source_file, reference_file, options)
    if as_json:
        typer.echo(report.model_dump_json(indent=2))
        return
    for key, value in _numbers(report.model_dump(mode="json")["quality"]["input"]):
        typer.echo(f"{key:<36} {value:.6g}")


def _numbers(section: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, float]]:
    """Every number of a nested section, by its dotted key."""
    for name, value in section.items():
        if isinstance(value, Mapping):
            yield from _numbers(value, f"{prefix}{name}.")
        elif isinstance(value, (int, float)) and not isinstance(value, bool):
            yield prefix + name, float(value)
