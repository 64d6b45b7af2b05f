"""``meshcone verify``: the certificate, checked again."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from meshcone.errors import InputError
from meshcone.local_files import read_bytes, read_local
from meshcone.outputs import certificate_path
from meshcone.places import is_missing
from service.cli.telling import tell

_FAILED = 1  # exit code


def command(
    report: Annotated[
        Path, typer.Argument(metavar="REPORT", help="Report of the refinement.", show_default=False)
    ],
    source: Annotated[Path, typer.Option(help="The mesh that was sent.", show_default=False)],
    reference: Annotated[
        Path, typer.Option(help="The reference that was sent.", show_default=False)
    ],
    refined: Annotated[Path, typer.Option(help="The mesh that came back.", show_default=False)],
    certificate: Annotated[
        Path | None,
        typer.Option(help="Its certificate. [default: REPORT's name with .certificate.npz]"),
    ] = None,
    replay: Annotated[
        bool, typer.Option("--replay", help="Refine again, and compare what comes out.")
    ] = False,
) -> int:
    """Check the claims of a report again, without a solver.

    It prints a line for each check, and exits with 1 if one of them fails. The last line says
    what is proven. With --replay every round is solved again.
    """
    from meshcone.files import MeshFile

    # numpy and libigl, not for a mistyped name
    from meshcone.verbs.verify import read_report, verify

    read = read_report(read_bytes(report), report.name)
    place = certificate_path(report) if certificate is None else certificate
    if read.certificate is None and is_missing(place):
        words = "the report has no certificate: the input was kept, and no closeness was proven"
        raise InputError(words, file=report.name)
    evidence = (
        MeshFile(place.name, read_bytes(place)),
        read_local(source, read.options.cones.pin.vertices_file),
        read_local(reference),
        read_local(refined),
    )
    if replay:
        from meshcone.verbs.replay import verify_by_replay as verify  # loads the solver: 2.5 s
    verification = verify(read, *evidence)
    for line in str(verification).split("\n"):
        tell(line)
    return 0 if verification.ok else _FAILED
