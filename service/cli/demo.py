"""``meshcone demo``: the whole service at work on a pair of its own."""

from __future__ import annotations

import json
import os
import shlex
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import chain, count
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from meshcone.errors import InputError
from meshcone.files import MeshFile
from meshcone.local_files import read_bytes
from meshcone.outputs import certificate_path, require_places, write_together
from meshcone.places import reason
from meshcone.text import printable

if TYPE_CHECKING:
    from service.demo.display import Display
    from service.demo.session import DemoResult

_SOURCE, _REFERENCE, _REFINED = "source.glb", "reference.glb", "refined.glb"
_REPORT = "report.json"
_CERTIFICATE = certificate_path(Path(_REPORT)).name
_DIAGNOSTICS, _BEFORE_AFTER, _CONVERGENCE = "diagnostics.csv", "before-after.png", "convergence.png"
_WRITTEN = (
    _SOURCE,
    _REFERENCE,
    _REFINED,
    _REPORT,
    _CERTIFICATE,
    _DIAGNOSTICS,
    _BEFORE_AFTER,
    _CONVERGENCE,
)


def command(
    out: Annotated[Path, typer.Option(help="Directory for the files that the demo writes.")] = Path(
        "meshcone-demo"
    ),
) -> None:
    """Refine a noisy jug and print the result.

    The demo starts a service, sends it the job, and leaves the files in a folder.
    """
    from rich.console import Console

    from service.cli.metrics_table import metrics_table
    from service.cli.summary import summary_lines
    from service.demo.asset import degraded, reference_glb
    from service.demo.display import Display
    from service.demo.interruption import interruptible
    from service.demo.session import run_session

    _make_directory(out)
    console = Console(markup=False, emoji=False)  # the folder's name is no markup
    with interruptible(), Display(console) as display, _working_directory(out, display) as data_dir:
        display.step("making a jug, and a copy of it with noise")
        reference = MeshFile(_REFERENCE, reference_glb())
        require_own(out, reference.data)
        source = MeshFile(_SOURCE, degraded(reference.data))
        result = run_session(source, reference, data_dir, display)
        display.step("drawing the pictures")
        contents = _files(source, reference, result)
    write_together({out / name: data for name, data in contents.items()})
    console.print(metrics_table(result.report))
    for line in summary_lines(result.report):
        console.print(line, highlight=False, soft_wrap=True)
    console.print(
        f"files          in {printable(str(out))}: {', '.join(contents)}",
        highlight=False,
        soft_wrap=True,
    )
    if result.certificate is not None:
        console.print("check it again with", highlight=False)
        console.print(_verify_command(out), highlight=False, soft_wrap=True)


def _files(source: MeshFile, reference: MeshFile, result: DemoResult) -> dict[str, bytes]:
    from service.demo.asset import face_colours
    from service.demo.before_after import Triple, draw_before_after
    from service.demo.convergence import draw_convergence

    proof = {} if result.certificate is None else {_CERTIFICATE: result.certificate}
    triple = Triple(source.data, result.refined, reference.data, face_colours())
    return {
        source.name: source.data,
        reference.name: reference.data,
        _REFINED: result.refined,
        _REPORT: json.dumps(result.report, indent=2).encode() + b"\n",
        **proof,
        _DIAGNOSTICS: result.diagnostics_csv.encode(),
        _BEFORE_AFTER: draw_before_after(triple, result.report),
        _CONVERGENCE: draw_convergence(result.report),
    }


def _verify_command(out: Path) -> str:
    files = {"source": _SOURCE, "reference": _REFERENCE, "refined": _REFINED}
    named = [f"--{name} {shlex.quote(str(out / file))}" for name, file in files.items()]
    return " ".join([*_this_program(), "verify", shlex.quote(str(out / _REPORT)), *named])


def _this_program() -> list[str]:
    """What a shell knows this program by; `make demo` leaves its scripts off the PATH."""
    if shutil.which("meshcone"):
        return ["meshcone"]
    called = Path(sys.argv[0])
    if called.name == "meshcone":
        return [shlex.quote(str(called))]
    return [shlex.quote(sys.executable), "-P", "-m", "service.cli"]


def _make_directory(path: Path) -> None:
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot be used: {reason(error)}", file=str(path)) from None


def require_own(out: Path, jug: bytes) -> None:
    """Refuse a folder with somebody's files of the demo's names.

    They are the demo's own where its jug is among them: then it was run here before.

    Raises:
        InputError: there are such files, or one of the demo's cannot be written.
    """
    require_places([out / name for name in _WRITTEN], [])
    there = [name for name in _WRITTEN if os.path.lexists(out / name)]
    if there and not (_REFERENCE in there and read_bytes(out / _REFERENCE) == jug):
        raise InputError(
            f"has files that would be overwritten and that this demo did not write: "
            f"{', '.join(there)}; give another folder by --out",
            file=str(out),
        )


def free_place(place: Path) -> Path:
    """A place of this name, or with a number in it where somebody has a file of the name."""
    numbered = (place.with_stem(f"{place.stem}-{number}") for number in count(2))
    return next(each for each in chain([place], numbered) if not os.path.lexists(each))


@contextmanager
def _working_directory(out: Path, display: Display) -> Iterator[Path]:
    """A temporary directory; if what is done in it fails, the service's log outlives it."""
    from service.demo.interruption import deferred
    from service.demo.session import LOG_NAME
    from worker.run.stopping import StopRequest

    with deferred(StopRequest(grace=0)):
        directory = tempfile.TemporaryDirectory(prefix="meshcone-demo-")
    with directory as name:
        log = Path(name) / LOG_NAME
        try:
            yield Path(name)
        except Exception:  # whatever it was is raised again; only the log is saved first
            with suppress(OSError):  # why it failed is to be said, not that the log is lost
                kept = free_place(out / LOG_NAME)
                shutil.copyfile(log, kept)
                display.step(f"failed: the service's log is in {printable(str(kept))}")
            raise
