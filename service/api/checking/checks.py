"""Has meshes checked by processes that a file may end without ending the API."""

from __future__ import annotations

import asyncio
import json
import os
import socket
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, Any, Self

import structlog
from anyio import CapacityLimiter, to_thread

from meshcone.errors import InputError, InternalError, LimitError
from meshcone.options import Options
from meshcone.scratch import remove_orphans, scratch
from service.api.checking import process
from service.problems import ProblemError, problem
from service.settings import ServiceSettings

CHECKS_AT_ONCE = 2
_TURN_SECONDS = 30.0
_CHECK_SECONDS = 90  # on a machine that has other things to do
_GRACE = 5.0  # seconds beyond, in which the kernel ends a child that is over its time
_ATTEMPTS = 2
_INHERITED = ("PATH", "TMPDIR", "LANG", "TZ", "VIRTUAL_ENV", "SYSTEMROOT")
_INHERITED_PREFIXES = ("PYTHON", "LC_", "LD_", "DYLD_", "MESHCONE_LIMIT_")

logger = structlog.get_logger(__name__)


@dataclass(frozen=True)
class MeshFiles:
    """A mesh to check, and the files it may name; all of them open for reading."""

    name: str
    file: IO[bytes]
    resources: Mapping[str, IO[bytes]] = field(default_factory=dict)


class _NoAnswerError(Exception):
    """The process ended before it had answered."""


class _LateError(Exception):
    """It did not end in time, whatever it waited for."""


class MeshChecks:
    """Checks meshes in processes of their own, few at a time.

    Memory and processor time of a check are bounded by the settings. The processes end with
    this one.

    Args:
        settings: of the front end.
        turn_seconds: how long a request waits for others' checks.
        check_seconds: how long one check may take, whatever it waits for.
    """

    def __init__(
        self,
        settings: ServiceSettings,
        *,
        turn_seconds: float = _TURN_SECONDS,
        check_seconds: int = _CHECK_SECONDS,
    ) -> None:
        self._settings = settings
        self._turn_seconds = turn_seconds
        self._check_seconds = check_seconds
        self._turns = asyncio.Semaphore(CHECKS_AT_ONCE)
        self._threads = CapacityLimiter(CHECKS_AT_ONCE)
        self._parent = _Parent(settings, check_seconds)

    def __enter__(self) -> Self:
        remove_orphans()
        self._parent.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._parent.end()

    @property
    def pid(self) -> int:
        """Process id of the parent of all checks."""
        return self._parent.pid

    async def check(self, source: MeshFiles, reference: MeshFiles | None, options: Options) -> bool:
        """Read the meshes, and check that the source can be written back where it has to be.

        Returns:
            Whether they were read. A process that dies over the files twice, or is not done in
            time, says nothing of them: whoever works on them has to find out.

        Raises:
            InputError: a file is no mesh, or names a resource that was not sent.
            LimitError: a file is larger than can be worked on, or takes more memory or
                processor time than the settings allow for a check.
            ProblemError: too many others wait.
        """
        try:
            async with asyncio.timeout(self._turn_seconds):
                await self._turns.acquire()
        except TimeoutError:
            raise _busy("too many files are being checked; try again") from None
        try:
            return await to_thread.run_sync(
                self._check, source, reference, options, limiter=self._threads
            )
        finally:
            self._turns.release()

    def _check(self, source: MeshFiles, reference: MeshFiles | None, options: Options) -> bool:
        for _ in range(_ATTEMPTS):
            try:
                with scratch() as place:
                    answer = self._ask(source, reference, options, place)
            except _NoAnswerError:
                logger.warning("a check of meshes ended without an answer")
            except _LateError:  # the next one would be, too
                logger.warning("a check of meshes was not done in time")
                break
            else:
                self._judge(answer)
                return True
        other = None if reference is None else reference.name
        logger.warning("meshes accepted unchecked", source=source.name, reference=other)
        return False

    def _ask(
        self, source: MeshFiles, reference: MeshFiles | None, options: Options, place: Path | None
    ) -> dict[str, Any]:
        """Have files checked once; temporary files go to ``place``.

        Raises:
            _NoAnswerError: the process died.
            _LateError: it did not end in time.
        """
        meshes = {"source": source}
        if reference is not None:
            meshes["reference"] = reference
        request = {
            "options": options.model_dump(mode="json"),
            "scratch": None if place is None else str(place),
            "meshes": {
                side: {"name": mesh.name, "resources": list(mesh.resources)}
                for side, mesh in meshes.items()
            },
        }
        ours, theirs = socket.socketpair()
        with ours, TemporaryFile() as document, ExitStack() as lent:
            document.write(json.dumps(request).encode())
            files: list[IO[bytes]] = [document]
            for mesh in meshes.values():
                files += [mesh.file, *mesh.resources.values()]
            descriptors = [_lend(file, lent) for file in files]
            ours.settimeout(self._check_seconds + _GRACE)
            try:
                with theirs:
                    self._parent.connect(theirs)
                _send(ours, descriptors)
                answer = b"".join(iter(lambda: ours.recv(65_536), b""))
            except TimeoutError:
                self._parent.end()  # it hangs, or its child would have been ended by the kernel
                raise _LateError from None
            except OSError as error:
                raise _NoAnswerError from error
        if not answer.endswith(b"\n"):
            raise _NoAnswerError
        said: dict[str, Any] = json.loads(answer)
        if said.get("kind") == process.LATE:
            raise _LateError
        return said

    def _judge(self, answer: dict[str, Any]) -> None:
        kind = answer.get("kind")
        if kind is None:
            return
        if kind == process.OUT_OF_MEMORY:
            allowed = self._settings.precheck_memory_bytes
            raise LimitError(
                f"reading the files takes more than the {allowed:,} bytes of memory allowed here "
                "for checking them (MESHCONE_PRECHECK_MEMORY_BYTES)"
            )
        if kind == process.OUT_OF_TIME:
            raise LimitError(
                f"reading the files takes more than the {self._settings.precheck_seconds} seconds "
                "of processor time allowed here for checking them (MESHCONE_PRECHECK_SECONDS)"
            )
        where = {"file": answer.get("file"), "place": answer.get("place")}
        if kind == "input":
            raise InputError(answer["message"], **where)
        if kind == "limit":
            raise LimitError(answer["message"], **where)
        logger.error("a mesh could not be checked", reason=answer["message"])
        raise InternalError("an unexpected error in the service; it has been logged")


class _Parent:
    """The process that forks a child for each check; started again where it has ended."""

    def __init__(self, settings: ServiceSettings, check_seconds: int) -> None:
        self._limits = [settings.precheck_memory_bytes, settings.precheck_seconds, check_seconds]
        self._lock = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._control: socket.socket | None = None

    @property
    def pid(self) -> int:
        with self._lock:
            assert self._process is not None  # noqa: S101 - for the type checker
            return self._process.pid

    def connect(self, connection: socket.socket) -> None:
        """Have a child forked that answers on a connection.

        Raises:
            OSError: the process cannot be started.
        """
        with self._lock:
            if self._process is None or self._process.poll() is not None:
                self._restart()
            assert self._control is not None  # noqa: S101 - for the type checker
            socket.send_fds(self._control, [process.MORE], [connection.fileno()])

    def start(self) -> None:
        """Start it before it is needed."""
        with self._lock:
            self._restart()

    def end(self) -> None:
        """End it and every check that goes on."""
        with self._lock:
            self._end()

    def _restart(self) -> None:
        self._end()
        ours, theirs = socket.socketpair()
        with theirs:
            arguments = map(str, [theirs.fileno(), *self._limits])
            self._process = subprocess.Popen(  # noqa: S603 - our own program
                [sys.executable, "-P", "-m", process.__name__, *arguments],
                env=_environment(),
                pass_fds=[theirs.fileno()],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                start_new_session=True,  # a Ctrl-C in a terminal is for the API alone
            )
        self._control = ours

    def _end(self) -> None:
        if self._control is not None:
            self._control.close()
            self._control = None
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._process = None


def _environment() -> dict[str, str]:
    """What the process needs to run; none of the API's secrets and addresses."""
    return {
        name: value
        for name, value in os.environ.items()
        if name in _INHERITED or name.startswith(_INHERITED_PREFIXES)
    }


def _send(connection: socket.socket, descriptors: Sequence[int]) -> None:
    step = process.DESCRIPTORS_AT_ONCE
    for start in range(0, len(descriptors), step):
        said = process.MORE if start + step < len(descriptors) else process.LAST
        socket.send_fds(connection, [said], descriptors[start : start + step])


def _lend(file: IO[bytes], lent: ExitStack) -> int:
    """A descriptor of an open file; on Linux it cannot be changed through it."""
    file.seek(0)  # writes what is still in a buffer, too
    descriptor = file.fileno()
    with suppress(FileNotFoundError):  # no such name but on Linux
        descriptor = os.open(f"/proc/self/fd/{descriptor}", os.O_RDONLY)
        lent.callback(os.close, descriptor)
    return descriptor


def _busy(words: str) -> ProblemError:
    return ProblemError(problem("unavailable", words), {"Retry-After": "2"})
