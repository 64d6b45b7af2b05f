"""``meshcone thresholds``: gates proposed from assets that somebody has accepted."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from meshcone.errors import InputError
from meshcone.outputs import require_places, write_together
from service.cli.arguments import Assignments, options_from

if TYPE_CHECKING:
    from meshcone.gates.results import AssetResult
    from meshcone.report.report import AnyReport


def command(
    paths: Annotated[
        list[Path],
        typer.Argument(
            metavar="FOLDER [REFERENCES]",
            help="The accepted assets, and the folder of their references, if they have any.",
            show_default=False,
        ),
    ],
    reference_pattern: Annotated[
        str | None,
        typer.Option(
            metavar="PATTERN",
            help="Where the reference of each asset is, such as '{stem}_LOD0.glb'.",
            show_default=False,
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", help="Gate file to write. [default: print it]"),
    ] = None,
    percentile: Annotated[
        float,
        typer.Option(min=50, max=100, help="Percentage of the assets that each bound lets pass."),
    ] = 99.0,
    jobs: Annotated[
        int | None,
        typer.Option(min=1, max=256, help="Assets at a time. [default: one for each processor]"),
    ] = None,
    assignments: Assignments = None,
) -> None:
    """Propose gates from a folder of accepted assets.

    Each bound is the percentile of what the assets have, with the asset that sets it. Alone, assets
    are audited; against references, they are measured as well.
    """
    from meshcone.gates.thresholds import gate_file, thresholds
    from service.gating.display import progress_bar
    from service.gating.job import GateJob, run_jobs
    from service.gating.local import LocalGatekeeper
    from service.gating.matching import pairs_to_gate

    pairs = pairs_to_gate(paths, None, reference_pattern, always=set())
    options = options_from(assignments)
    for name in ("mode", "gates", "keep", "within"):
        if name in options.model_fields_set:
            raise InputError(
                f"option '{name}' says nothing of what accepted assets have: leave it out"
            )
    listed = options.cones.pin.vertices_file
    require_places([out], (file for pair in pairs for file in pair.files(listed)))
    work = [
        GateJob(
            pair,
            options.model_copy(update={"mode": "audit" if pair.reference is None else "measure"}),
            reported=True,
        )
        for pair in pairs
    ]
    keeper = LocalGatekeeper({job.options.mode for job in work})
    with progress_bar(len(work)) as show:
        run = run_jobs(work, keeper, min(jobs or os.cpu_count() or 1, len(work)), show)
    reports = [(asset.name, _report(asset)) for asset in run.assets]
    text = gate_file(thresholds(reports, percentile), len(reports))
    if out is None:
        typer.echo(text, nl=False)
    else:
        write_together({out: text.encode()})


def _report(asset: AssetResult) -> AnyReport:
    from pydantic import TypeAdapter

    from meshcone.report.report import AnyReport

    if asset.error is not None or asset.view is None:
        message = "has no report" if asset.error is None else asset.error.message
        raise InputError(f"{message}: an accepted asset must be one that can be used")
    reader: TypeAdapter[AnyReport] = TypeAdapter(AnyReport)
    return reader.validate_json(asset.view.report)
