"""Gating on this machine: a process for each pair, so that none can take others with it."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterable, Mapping
from contextlib import closing
from multiprocessing import forkserver
from multiprocessing.connection import Connection
from multiprocessing.context import ForkServerProcess
from pathlib import Path
from typing import TYPE_CHECKING, get_args

from meshcone.errors import InputError, InternalError, LimitError, MeshConeError
from meshcone.files import MeshFile
from meshcone.gates.results import AssetResult, AssetView, Judgement
from meshcone.lifeline import die_with_parent
from meshcone.local_files import read_local
from meshcone.options import Mode
from meshcone.scratch import remove_orphans, scratch, work_in
from service.api.request_schemas import LinkedFile
from service.gating.job import GateJob, judged
from service.gating.pairs import Place, shown

if TYPE_CHECKING:
    from meshcone.report.report import AnyReport
    from meshcone.verbs.measure import Measurement
    from meshcone.verbs.refine import Refinement

_SAFE_PATH = "PYTHONSAFEPATH"  # as the option -P
VIEWED_FACES = 20_000  # of each mesh in a page, which may hold a dozen assets
_ENGINES: Mapping[Mode, str] = {mode: f"meshcone.verbs.{mode}" for mode in get_args(Mode)}
_IMPORTED_LATE = ("meshcone.surface.box_tree", "igl")  # with the first pair that needs them


class LocalGatekeeper:
    """Does every job in a process of its own.

    The processes are forked from one that has imported the engine, which takes longer than
    most measurements do.
    """

    def __init__(self, modes: Iterable[Mode]) -> None:
        """Prepare; ``modes`` says which engines the jobs will need."""
        self._context = multiprocessing.get_context("forkserver")
        engines = [_ENGINES[mode] for mode in sorted(modes)]
        self._context.set_forkserver_preload([*engines, *_IMPORTED_LATE, __name__])
        _start_forkserver()  # while there are no threads yet
        remove_orphans()
        self._lock = threading.Lock()
        self._running: set[ForkServerProcess] = set()
        self._stopped = False

    def judge(self, job: GateJob) -> AssetResult:
        """Do a job; its errors are part of the answer."""
        return judged(job, self._work)

    def stop(self) -> None:
        """End the processes that run, and start no more."""
        with self._lock:
            self._stopped = True
            for process in self._running:
                process.terminate()

    def _work(self, job: GateJob) -> Judgement:
        receiver, sender = self._context.Pipe(duplex=False)
        with scratch() as place, closing(receiver):
            process = self._context.Process(target=_child, args=(sender, job, place), daemon=True)
            self._start(process)
            sender.close()  # or its end would never be seen
            answer: Judgement | MeshConeError | None
            try:
                answer = receiver.recv()
            except (EOFError, OSError):  # OSError where it died while it was sending
                answer = None
            finally:
                self._finish(process)
        if answer is None:
            raise InternalError(f"the process that worked on it {_ended(process.exitcode)}")
        if isinstance(answer, MeshConeError):
            raise answer
        return answer

    def _start(self, process: ForkServerProcess) -> None:
        with self._lock:
            if self._stopped:
                raise InternalError("not begun: the run was stopped")
            process.start()
            self._running.add(process)

    def _finish(self, process: ForkServerProcess) -> None:
        process.join()
        with self._lock:
            self._running.discard(process)


def _start_forkserver() -> None:
    """Start it without the working directory among the places of modules.

    There may be a folder ``service`` in it that is not this program's. Console scripts leave it
    out; the interpreter of a fork server does not, unless it is told to.
    """
    before = os.environ.get(_SAFE_PATH)
    os.environ[_SAFE_PATH] = "1"
    try:
        forkserver.ensure_running()
    finally:
        if before is None:
            del os.environ[_SAFE_PATH]
        else:
            os.environ[_SAFE_PATH] = before


def _ended(code: int | None) -> str:
    if code is not None and code < 0:
        name = signal.Signals(-code).name
        return f"was ended by {name}; that may be for want of memory"
    return f"ended with exit code {code}"


def _child(sender: Connection, job: GateJob, place: Path | None) -> None:
    die_with_parent(os.getppid(), signal.SIGKILL)
    work_in(place)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent decides what a Ctrl-C ends
    answer: object
    try:
        answer = _judgement(job)
    except MeshConeError as error:
        answer = error
    except MemoryError:
        answer = LimitError("needs more memory than this machine has")
    except Exception as error:  # noqa: BLE001 - whatever it is, it concerns this pair alone
        answer = InternalError(f"unexpected {type(error).__name__}: {error}")
    sender.send(answer)


def _read(place: Place, listed: str | None = None) -> MeshFile:
    if isinstance(place, LinkedFile):
        raise InputError("is a URL, which only a service fetches: give --server", file=shown(place))
    return read_local(place, listed)


def _judgement(job: GateJob) -> Judgement:
    source = _read(job.pair.source, job.options.cones.pin.vertices_file)
    reference = None if job.pair.reference is None else _read(job.pair.reference)
    done: Measurement | Refinement
    if job.options.mode == "audit" or reference is None:
        from meshcone.verbs.audit import audit

        report = audit(source, reference, job.options)
        return _of(report, _text(report) if job.viewed or job.reported else None)
    if job.options.mode == "measure":
        from meshcone.verbs.measure import measurement

        done = measurement(source, reference, job.options)
    else:
        from meshcone.verbs.within import refine_within

        done = refine_within(source, reference, job.options)
    if job.viewed:
        return _of(done.report, _view(done))
    return _of(done.report, _text(done.report) if job.reported else None)


def _of(report: AnyReport, view: AssetView | None = None) -> Judgement:
    return Judgement.of(report.model_dump(include={"gates", "warnings", "statement"}), view)


def _text(report: AnyReport) -> AssetView:
    return AssetView(report=report.model_dump_json(), preview=None)


def _view(done: Measurement | Refinement) -> AssetView:
    from meshcone.views.pictures import pictures_png
    from meshcone.views.preview import preview_glb

    return AssetView(
        report=done.report.model_dump_json(),
        preview=preview_glb(done.scene, VIEWED_FACES),
        pictures=pictures_png(done.scene),
    )
