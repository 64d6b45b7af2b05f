"""Broker, API and workers on this machine, as one thing to start and stop."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Self

import httpx2

from meshcone.errors import InternalError
from service.server import listen
from worker.broker import EmbeddedBroker
from worker.connections import connect_bytes
from worker.lifeline import tied_command
from worker.queue import JobQueue
from worker.settings import WorkerSettings

READY_TIMEOUT = 60.0  # seconds; a worker imports the solver first, 2.5 s on an idle machine
API_STOP_TIMEOUT = 15.0  # seconds
WORKER_STOP_TIMEOUT = 10.0  # seconds; a longer job is started again when the service is


@dataclass(frozen=True)
class _Child:
    name: str
    process: subprocess.Popen[bytes]


class Stack:
    """An embedded broker (unless one is given), the API and some workers.

    The children end with this process, however it ends; a job in hand is then started
    again by the next stack on the same data.

    Args:
        settings: whose ``redis_url``, if any, replaces the embedded broker.
        host: address to listen on.
        port: port to listen on; 0 lets the system choose.
        workers: number of worker processes.
        log: file the children write to, instead of this process's stderr.
        given_up: asked while waiting for the start; true ends the wait.

    Attributes:
        url: where the API listens, once started.
    """

    def __init__(
        self,
        settings: WorkerSettings,
        *,
        host: str = "127.0.0.1",
        port: int = 0,
        workers: int = 1,
        log: Path | None = None,
        given_up: Callable[[], bool] = lambda: False,
    ) -> None:
        self._settings = settings
        self._given_up = given_up
        self._address = (host, port)
        self._workers = workers
        self._log = log
        self._broker: EmbeddedBroker | None = None
        self._children: list[_Child] = []
        self.redis_url = settings.redis_url or ""
        self.url = ""

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.stop()

    def start(self) -> None:
        """Start everything and wait until a job could be sent and worked on.

        Raises:
            InputError: the address or the data directory cannot be had.
            InternalError: something did not start.
        """
        try:
            self._start()
        except BaseException:  # also Ctrl-C: nothing may be left running
            self.stop()
            raise

    def _start(self) -> None:
        with listen(*self._address) as listener:
            host, port = listener.getsockname()[:2]
            self.url = f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"
            if self._settings.redis_url is None:
                self._broker = EmbeddedBroker(self._settings.data_dir)
                self._broker.start()
                self.redis_url = self._broker.url
            for number in range(self._workers):
                self._spawn(f"worker {number + 1}", ["worker"])
            self._spawn("API", ["api", "--fd", str(listener.fileno())], [listener.fileno()])
        self._wait_until_ready()

    def stop(self) -> None:
        """End everything, the API first, the broker last. Harmless if nothing runs."""
        api = [child for child in self._children if child.name == "API"]
        workers = [child for child in self._children if child.name != "API"]
        _end(api, API_STOP_TIMEOUT)
        _end(workers, WORKER_STOP_TIMEOUT)
        self._children.clear()
        if self._broker is not None:
            self._broker.stop()
            self._broker = None

    def worker_pids(self) -> list[int]:
        """Process ids of the workers."""
        return [child.process.pid for child in self._children if child.name != "API"]

    def check(self) -> None:
        """Look whether everything still runs.

        Raises:
            InternalError: naming what has ended unasked.
        """
        for child in self._children:
            if child.process.poll() is not None:
                raise InternalError(f"the {child.name} ended unexpectedly; see its log")
        if self._broker is not None and self._broker.has_ended():
            raise InternalError("the embedded broker ended unexpectedly; see its log")

    def _spawn(self, name: str, arguments: Sequence[str], fds: Sequence[int] = ()) -> None:
        environment = {
            **os.environ,
            **_environment(self._settings),
            "MESHCONE_REDIS_URL": self.redis_url,
        }
        command = tied_command([sys.executable, "-m", "service.cli", *arguments], signal.SIGKILL)
        log = self._log.open("ab") if self._log else None
        try:
            process = subprocess.Popen(  # noqa: S603 - our own program
                command,
                env=environment,
                pass_fds=fds,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                # Ctrl-C in a terminal is for the parent alone, which stops them in order.
                start_new_session=True,
            )
        finally:
            if log is not None:
                log.close()
        self._children.append(_Child(name, process))

    def _wait_until_ready(self) -> None:
        deadline = time.monotonic() + READY_TIMEOUT
        while time.monotonic() < deadline:
            self.check()
            if self._is_ready() or self._given_up():
                return
            time.sleep(0.1)
        raise InternalError(f"the service was not ready within {READY_TIMEOUT:g} s; see its log")

    def _is_ready(self) -> bool:
        try:
            answer = httpx2.get(f"{self.url}/readyz", timeout=5, trust_env=False)
        except httpx2.TransportError:
            return False
        with connect_bytes(self.redis_url) as client:
            registered = JobQueue(self._settings, client).local_worker_pids()
        # Workers of a stack that was killed are still registered for a while: look for ours.
        return answer.is_success and registered.issuperset(self.worker_pids())


def _environment(settings: WorkerSettings) -> dict[str, str]:
    """The variables from which the children read the settings that were set here."""
    return {
        f"MESHCONE_{name.upper()}": str(getattr(settings, name))
        for name in sorted(settings.model_fields_set)
        if getattr(settings, name) is not None
    }


def _end(children: Sequence[_Child], timeout: float) -> None:
    for child in children:
        child.process.terminate()
    deadline = time.monotonic() + timeout
    for child in children:
        try:
            child.process.wait(max(0.0, deadline - time.monotonic()))
        except subprocess.TimeoutExpired:
            child.process.kill()
            child.process.wait()
