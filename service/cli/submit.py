"""``meshcone submit``: one job, done by a service."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, get_args, overload

import typer

from meshcone.errors import InputError, InternalError, MeshConeError
from meshcone.local_files import files_of, left_behind, read_local
from meshcone.outputs import (
    certificate_path,
    certificate_place,
    require_format,
    require_places,
    write_together,
)
from meshcone.suggestions import did_you_mean
from service.cli.arguments import Assignments, Per, options_from
from service.cli.boundary import NOT_REACHED
from service.cli.missed import Missed, missed
from service.cli.progress_bar import progress_bar
from service.cli.submit_batch import JOB_TIMEOUT, submit_batch
from service.cli.telling import tell

if TYPE_CHECKING:
    from meshcone.files import MeshFile
    from service.api.request_schemas import LinkedFile, OutputPlace
    from service.api.schemas import Job
    from service.client import Client
    from worker.jobs.records import OutputName


def command(
    source: Annotated[
        str | None,
        typer.Argument(
            metavar="SOURCE",
            help="The mesh: a file, or https:// or s3:// for the service to fetch it.",
            show_default=False,
        ),
    ] = None,
    reference: Annotated[
        str | None,
        typer.Argument(
            metavar="REFERENCE",
            help="The reference, named the same way; only the mode audit needs none.",
            show_default=False,
        ),
    ] = None,
    *,
    server: Annotated[
        str,
        typer.Option(
            metavar="URL", help="Address of the service that does the work.", show_default=False
        ),
    ],
    batch: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.json",
            help="Batch to send in place of SOURCE and REFERENCE, as POST /v1/batches takes it.",
            show_default=False,
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("-o", "--out", help="Refined mesh to write.", show_default=False),
    ] = None,
    report: Annotated[
        Path | None,
        typer.Option(
            help="Report to write, as JSON, with its certificate beside it.", show_default=False
        ),
    ] = None,
    label: Annotated[
        list[str] | None,
        typer.Option(help="Name to find the job by; can be repeated.", show_default=False),
    ] = None,
    webhook: Annotated[
        str | None,
        typer.Option(
            metavar="URL",
            help="Address that the service calls when the job has ended.",
            show_default=False,
        ),
    ] = None,
    source_secret: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Secret of the service to fetch SOURCE with, by its name.",
            show_default=False,
        ),
    ] = None,
    source_sha256: Annotated[
        str | None,
        typer.Option(
            metavar="HASH",
            help="SHA-256 that must be that of what is fetched as SOURCE.",
            show_default=False,
        ),
    ] = None,
    reference_secret: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="Secret to fetch REFERENCE with.", show_default=False),
    ] = None,
    reference_sha256: Annotated[
        str | None,
        typer.Option(metavar="HASH", help="SHA-256 that REFERENCE must have.", show_default=False),
    ] = None,
    put: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=URL",
            help="Address that the service sends a result to, such as mesh=https://… or "
            "report=s3://bucket/key; can be repeated.",
            show_default=False,
        ),
    ] = None,
    per: Per = None,
    assignments: Assignments = None,
) -> int:
    """Send SOURCE and REFERENCE to a service.

    With --out or --report the command waits until the job has ended, and writes the files. Without
    them it prints the address of the job and ends. It exits with 1 if a tolerance (--set
    within=0.5mm) is not reached or a gate (--set gates=…) is not passed. With --batch it waits for
    the last job, prints every verdict and exits as `meshcone gate` does; --report then names the
    file for what `meshcone gate --json` writes. An API key is read from MESHCONE_API_KEY.
    """
    from service.client.links import is_link, source_name

    if batch is not None:
        others = (source, out, label, webhook, put, per, assignments, source_secret, source_sha256)
        if any((*others, reference_secret, reference_sha256)):
            raise InputError("--batch goes with --server and --report alone: all else is in it")
        return submit_batch(batch, server, report)
    if source is None:
        raise InputError("SOURCE is missing: name a mesh, or a --batch")
    options = options_from(assignments, per=per)
    if out is not None and options.mode != "refine":
        raise InputError(f"the mode '{options.mode}' makes no mesh: leave out --out")
    if reference is None and options.mode != "audit":
        raise InputError("REFERENCE is missing: only the mode audit can do without")
    if out is not None:
        require_format(out, source_name(source))
    outputs = _outputs(put or ())
    listed = options.cones.pin.vertices_file
    meshes = [(source, listed), (reference, None)]
    read = [
        file
        for mesh, also in meshes
        if mesh and not is_link(mesh)
        for file in files_of(Path(mesh), also)
    ]
    certificate = certificate_place(report) if options.mode == "refine" else None
    require_places((out, report, certificate), read)
    source_file = _file("source", source, source_secret, source_sha256, listed)
    reference_file = _file("reference", reference, reference_secret, reference_sha256)

    from service.client.connection import connect, service_errors

    with connect(server) as client, service_errors():
        job = client.submit(
            source_file,
            reference_file,
            options.model_dump(mode="json", exclude_unset=True),
            labels=label or (),
            webhook=webhook,
            outputs=outputs,
        )
        if out is None and report is None:
            tell(f"{server.rstrip('/')}{job.links.self}")
            return 0
        ended = _ended(client, job)
        contents = _results(client, ended, out, report)
        asked = options.within is not None or options.gates or options.keep
        short = missed(client.report(ended.id)) if asked else Missed((), failed=False)
    write_together(contents)
    _tell_left_behind(source_file, out, contents)
    for line in short.lines:
        tell(line, err=True)
    return NOT_REACHED if short.failed else 0


def _tell_left_behind(
    source: MeshFile | LinkedFile, out: Path | None, written: Mapping[Path, bytes]
) -> None:
    """Tell which files that were sent from here the mesh needs where it was written."""
    from meshcone.files import MeshFile

    if out is not None and isinstance(source, MeshFile):
        told = left_behind(source, written[out], out)
        if told is not None:
            tell(f"warning        {told}", err=True)


@overload
def _file(
    side: str, mesh: str, secret: str | None, sha256: str | None, listed: str | None = None
) -> MeshFile | LinkedFile: ...


@overload
def _file(
    side: str, mesh: str | None, secret: str | None, sha256: str | None
) -> MeshFile | LinkedFile | None: ...


def _file(
    side: str,
    mesh: str | None,
    secret: str | None,
    sha256: str | None,
    listed: str | None = None,
) -> MeshFile | LinkedFile | None:
    """What to send as one side of the pair.

    Raises:
        InputError: it cannot be read, or what is said of a URL is said of none.
    """
    from service.client.links import is_link, link_to

    if mesh is not None and is_link(mesh):
        return link_to(mesh, secret=secret, sha256=sha256)
    for name, value in (("secret", secret), ("sha256", sha256)):
        if value is not None:
            raise InputError(f"--{side}-{name} is for a {side.upper()} that is a URL")
    return None if mesh is None else read_local(Path(mesh), listed)


def _outputs(assignments: Iterable[str]) -> dict[OutputName, OutputPlace]:
    """Where results are to be put, by name.

    Raises:
        InputError: one is no result's name and a URL, or two have the same name.
    """
    from service.client.links import place_at
    from worker.jobs.records import OutputName

    names: tuple[OutputName, ...] = get_args(OutputName)
    outputs: dict[OutputName, OutputPlace] = {}
    for assignment in assignments:
        name, _, url = assignment.partition("=")
        known = next((each for each in names if each == name), None)
        if known is None:
            hint = did_you_mean(name, names) or f"; there are {', '.join(names)}"
            raise InputError(f"--put {name[:40]}: there is no result of that name{hint}")
        if known in outputs:
            raise InputError(f"--put {name}: a result can be put to one place only")
        outputs[known] = place_at(url)
    return outputs


def _ended(client: Client, job: Job) -> Job:
    with progress_bar() as show:

        def on_change(seen: Job) -> None:
            if show is not None and seen.progress is not None:
                show(seen.progress)

        try:
            ended = client.wait(job.id, timeout=JOB_TIMEOUT, on_change=on_change)
        except TimeoutError as error:
            raise InternalError(str(error)) from None
    if ended.state != "succeeded":
        raise _why_not(ended)
    return ended


def _why_not(job: Job) -> MeshConeError:
    from service.client.connection import error_of

    if job.error is None:
        return InputError(f"job {job.id} was canceled")
    return error_of(job.error)


def _results(client: Client, job: Job, out: Path | None, report: Path | None) -> dict[Path, bytes]:
    contents = {}
    if out is not None:
        contents[out] = client.mesh(job.id)
    if report is not None:
        contents[report] = client.report_bytes(job.id)
        if job.links.certificate is not None:
            contents[certificate_path(report)] = client.certificate(job.id)
    return contents
