"""``meshcone gate``: a verdict that a CI job can act on."""

from __future__ import annotations

import functools
import os
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from meshcone.errors import InputError
from meshcone.places import is_there
from meshcone.text import is_line
from service.cli.arguments import Assignments, Per, options_from
from service.cli.boundary import BAD_INPUT, INTERNAL
from service.cli.gate_choice import GateChoice, Gates, Keep, Product, Profile, Schema
from service.cli.telling import tell

if TYPE_CHECKING:
    from meshcone.gates.results import GateRun
    from meshcone.options import Mode, Options
    from service.gating.job import GateJob
    from service.gating.pairs import Pair

_NOT_PASSED = 1  # exit code


def command(
    paths: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar="SOURCE REFERENCE",
            help="The mesh and the mesh it should have been, or a folder of each. With "
            "--manifest: files that changed, to gate only the pairs they belong to.",
            show_default=False,
        ),
    ] = None,
    gates: Gates = None,
    profile: Profile = None,
    print_profile: Annotated[
        bool, typer.Option("--print", help="Print the gate file of --profile and do nothing else.")
    ] = False,
    schema: Schema = None,
    product: Product = None,
    keep: Keep = None,
    manifest: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE|GLOB",
            help="List of pairs, as TOML, JSON or CSV; or a glob of sources, in quotes.",
            show_default=False,
        ),
    ] = None,
    reference_pattern: Annotated[
        str | None,
        typer.Option(
            metavar="PATTERN",
            help="Where the reference of each source of a glob or folder is, such as "
            "'{stem}_LOD0.glb'.",
            show_default=False,
        ),
    ] = None,
    refine: Annotated[
        bool, typer.Option("--refine", help="Refine each source, and gate the result.")
    ] = False,
    json_file: Annotated[
        Path | None, typer.Option("--json", help="JSON to write.", show_default=False)
    ] = None,
    junit_file: Annotated[
        Path | None, typer.Option("--junit", help="JUnit XML to write.", show_default=False)
    ] = None,
    sarif_file: Annotated[
        Path | None, typer.Option("--sarif", help="SARIF 2.1.0 to write.", show_default=False)
    ] = None,
    html_file: Annotated[
        Path | None,
        typer.Option(
            "--html", help="HTML page to write, which shows every asset.", show_default=False
        ),
    ] = None,
    markdown_file: Annotated[
        Path | None,
        typer.Option("--markdown", help="Summary to write for a pull request.", show_default=False),
    ] = None,
    pictures: Annotated[
        Path | None,
        typer.Option(
            metavar="FOLDER",
            help="Where to draw what did not pass; --markdown shows it.",
            show_default=False,
        ),
    ] = None,
    label: Annotated[
        str | None,
        typer.Option(help="What the run is called in reports and jobs.", show_default=False),
    ] = None,
    server: Annotated[
        str | None,
        typer.Option(
            metavar="URL", help="Address of the service that does the work.", show_default=False
        ),
    ] = None,
    jobs: Annotated[
        int | None,
        typer.Option(min=1, max=256, help="Pairs at a time. [default: one for each processor]"),
    ] = None,
    per: Per = None,
    assignments: Assignments = None,
) -> int:
    """Judge meshes by gates, which are bounds on what is measured.

    The command judges SOURCE against REFERENCE, or every pair of a manifest or of two folders. An
    asset, or a folder of assets, can be judged without a reference. The command exits with 0 if
    every asset passes, 1 if one fails or could not be tested, 2 if one could not be used, 3 after
    a fault of MeshCone's own.
    """
    from service.gating.matching import pairs_to_gate
    from service.gating.outputs import Outputs

    if print_profile:
        return _print(profile)
    outputs = Outputs(json_file, junit_file, sarif_file, html_file, markdown_file, pictures)
    choice = GateChoice(profile, schema, product, keep, gates)
    own = [*choice.files(), *([] if manifest is None else [manifest])]
    outputs.require(own)
    _require_label(label)
    if choice == GateChoice():
        raise InputError("--gates is missing: name the file with the gates to pass, or a --profile")
    options = _options(assignments, per)
    listed = options.cones.pin.vertices_file
    pairs = pairs_to_gate(
        paths or [], manifest, reference_pattern, always=set(choice.files()), listed=listed
    )
    read = (file for pair in pairs for file in pair.files(listed))
    outputs.require(chain(own, read), len(pairs))
    if options.within is not None and not refine:
        raise InputError("option 'within' is a tolerance to refine to: it needs --refine")
    work = _jobs(pairs, choice, options, refine, outputs.viewed, label)
    if not outputs.viewed:
        work = [job.at_least_cost() for job in work]
    if manifest is not None:
        _tell_absent(paths or [])
    if not work:
        from meshcone.gates.results import GateRun

        outputs.write(GateRun.of([], label))  # those of a run before are not this one's
        typer.echo("no pair has one of these files")
        return 0
    run = _run(work, server, jobs or os.cpu_count() or 1)
    outputs.write(run)
    show_run(run)
    return exit_code_of(run)


def _tell_absent(paths: list[Path]) -> None:
    for path in paths:
        if not is_there(path):
            tell(f"warning        {path}: is not there: removed, or mistyped", err=True)


def _require_label(label: str | None) -> None:
    from service.api.request_schemas import LABEL_LENGTH

    if label is not None and not (is_line(label) and 0 < len(label) <= LABEL_LENGTH):
        raise InputError(f"--label must be one line of up to {LABEL_LENGTH} characters")


def _print(name: str | None) -> int:
    from meshcone.gates.profile import profile

    if name is None:
        raise InputError("--print needs --profile")
    typer.echo(profile(name).decode(), nl=False)
    return 0


def _options(assignments: list[str] | None, per: str | None) -> Options:
    options = options_from(assignments, per=per)
    if options.model_fields_set & {"mode", "gates"}:
        raise InputError("'mode' and 'gates' are set by --refine and --gates here")
    return options


def _jobs(
    pairs: list[Pair],
    choice: GateChoice,
    options: Options,
    refine: bool,
    viewed: bool,
    label: str | None,
) -> list[GateJob]:
    from service.gating.job import GateJob
    from service.gating.pairs import shown

    read = functools.cache(choice.read)
    jobs = []
    for pair in pairs:
        if pair.reference is None:
            if refine:
                raise InputError("--refine needs a reference", file=shown(pair.source))
            mode: Mode = "audit"
        else:
            mode = "refine" if refine else "measure"
        file = read(mode)
        table = {} if file is None else file.for_asset(pair.name, pair.level)
        own = options.model_copy(update={"mode": mode, "gates": dict(table)})
        _require_units(pair, own)
        jobs.append(GateJob(pair, own, viewed, label))
    return jobs


def _require_units(pair: Pair, options: Options) -> None:
    from meshcone.gates.fitting import require_units
    from meshcone.gates.units import format_named
    from service.gating.pairs import shown

    reference = None if pair.reference is None else format_named(shown(pair.reference))
    try:
        scaled = options.align == "similarity"
        require_units(options.gates, format_named(shown(pair.source)), reference, scaled=scaled)
    except InputError as error:
        raise InputError(error.message, file=pair.name) from None


def _run(work: list[GateJob], server: str | None, at_once: int) -> GateRun:
    from service.gating.display import progress_bar
    from service.gating.job import run_jobs

    if server is not None:
        from service.gating.remote import RemoteGate

        gate = RemoteGate(server, at_once)
        with progress_bar(len(work)) as show:
            return gate.run(work, show)
    from service.gating.local import LocalGatekeeper

    keeper = LocalGatekeeper({job.options.mode for job in work})
    with progress_bar(len(work)) as show:
        return run_jobs(work, keeper, min(at_once, len(work)), show)


def show_run(run: GateRun) -> None:
    """Print what came of every asset, errors on stderr."""
    from rich.console import Console

    from service.gating.display import check_lines, closing_line, finding_lines, summary_table

    for asset in run.assets:
        if asset.error is not None:
            message = " ".join(asset.error.message.split())
            # Most messages name a file by its last part, which several pairs may share.
            named = len(run.assets) == 1 or message.startswith(f"{asset.name}: ")
            tell(f"meshcone: {'' if named else f'{asset.name}: '}{message}", err=True)
    if len(run.assets) == 1:
        for line in check_lines(run.assets[0]):
            tell(line)
        return
    Console().print(summary_table(run))
    for line in finding_lines(run):
        tell(line)
    tell(closing_line(run))


def exit_code_of(run: GateRun) -> int:
    """The exit code of a run: 0 if every asset passes, 1, 2 or 3 by the worst that is not so."""
    if any(run.internal_errors()):
        return INTERNAL
    if run.verdict == "error":
        return BAD_INPUT
    return 0 if run.verdict == "pass" else _NOT_PASSED
