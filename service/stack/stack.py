"""Broker, API and workers on this machine, as one thing to start and stop."""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

import httpx2
from redis.exceptions import RedisError

from meshcone.errors import InputError, InternalError
from service.api.listening.address import listen
from service.stack.children import Child, end
from service.stack.restarts import Restarts
from worker.broker.connections import connect_bytes
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.queue import JobQueue
from worker.settings import WorkerSettings

READY_TIMEOUT = 180.0  # seconds; a worker imports the solver first, 2.5 s on an idle machine
API_STOP_TIMEOUT = 15.0  # seconds
WORKER_STOP_TIMEOUT = 10.0  # seconds for the job in hand; a longer one is handed back
HAND_BACK_TIMEOUT = 5.0  # seconds to do that
START_TRIES = 3  # of a program that ends by itself before it ever worked
_NO_WORKERS = ("MESHCONE_TRANSFER_AUTHORIZATIONS", "MESHCONE_WEBHOOK_SECRET")
"""Secrets that workers have no use for: they read strangers' files."""

_API = "API"
_UNUSABLE_SETTINGS = 2  # exit code of a command whose settings cannot be used


class Stack:
    """An embedded broker (unless one is given), the API, some workers, and what goes out.

    The children end with this process, however it ends; a job in hand is then started
    again by the next stack on the same data. What ends before is started again by
    :meth:`restart_ended`, which is to be called every now and then.

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
        self._listener: socket.socket | None = None
        self._children: list[Child] = []
        self._restarts: list[Restarts] = []
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
            InputError: the address or the data directory cannot be had, or the settings
                cannot be used.
            InternalError: something did not start.
        """
        try:
            self._start()
        except BaseException:  # also Ctrl-C: nothing may be left running
            self.stop()
            raise

    def _start(self) -> None:
        # Open as long as the stack is: who calls while the API starts again is kept waiting,
        # not refused.
        self._listener = listen(*self._address)
        host, port = self._listener.getsockname()[:2]
        self.url = f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"
        if self._settings.redis_url is None:
            self._broker = EmbeddedBroker(self._settings.data_dir)
            self._broker.start()
            self.redis_url = self._broker.url
            broker = self._broker
            self._restarts.append(Restarts("embedded broker", broker.launch, broker.ending))
        for number in range(self._workers):
            self._add(f"worker {number + 1}", ["worker"])
        self._add("webhooks", ["webhooks"])
        self._add("transfers", ["transfers"])
        fd = self._listener.fileno()
        self._add(_API, ["api", "--fd", str(fd)], [fd])
        self._wait_until_ready()

    def stop(self) -> None:
        """End everything, the API first, the broker last. Harmless if nothing runs."""
        end([child for child in self._children if child.name == _API], API_STOP_TIMEOUT)
        workers = [child for child in self._children if child.name != _API]
        end(workers, WORKER_STOP_TIMEOUT, HAND_BACK_TIMEOUT)
        self._children.clear()
        self._restarts.clear()
        if self._broker is not None:
            self._broker.stop()
            self._broker = None
        if self._listener is not None:
            self._listener.close()
            self._listener = None

    def pids(self) -> dict[str, int]:
        """Process ids by what the processes are called."""
        found = {child.name: child.process.pid for child in self._children}
        if self._broker is not None and self._broker.pid is not None:
            found["broker"] = self._broker.pid
        return found

    def worker_pids(self) -> list[int]:
        """Process ids of the workers."""
        return [pid for name, pid in self.pids().items() if name.startswith("worker")]

    def restart_ended(self) -> None:
        """Start again what has ended unasked; what keeps ending, after pauses that grow."""
        for restarts in self._restarts:
            restarts.look()

    def _add(self, name: str, arguments: Sequence[str], fds: Sequence[int] = ()) -> None:
        environment = {
            **os.environ,
            **_environment(self._settings),
            "MESHCONE_REDIS_URL": self.redis_url,
        }
        if arguments[0] == "worker":
            environment = {n: value for n, value in environment.items() if n not in _NO_WORKERS}
        child = Child(name, arguments, environment=environment, log=self._log, fds=fds)
        self._children.append(child)
        self._restarts.append(child.restarts)

    def _wait_until_ready(self) -> None:
        deadline = time.monotonic() + READY_TIMEOUT
        while time.monotonic() < deadline:
            for child in self._children:
                self._require_hope(child)
            self.restart_ended()
            if self._is_ready() or self._given_up():
                return
            time.sleep(0.1)
        raise InternalError(f"the service was not ready within {READY_TIMEOUT:g} s; see its log")

    def _require_hope(self, child: Child) -> None:
        """Tell a program that cannot run from one that something else has ended."""
        if child.code == _UNUSABLE_SETTINGS:
            raise InputError(f"the {child.name} cannot run with these settings; its log says why")
        if child.code and child.code > 0 and child.restarts.count >= START_TRIES - 1:
            raise InternalError(f"the {child.name} did not start; see its log")

    def _is_ready(self) -> bool:
        try:
            answer = httpx2.get(f"{self.url}/readyz", timeout=5, trust_env=False)
            with connect_bytes(self.redis_url) as client:
                registered = JobQueue(self._settings, client).local_worker_pids()
        except (httpx2.TransportError, RedisError):
            return False
        # Workers of a stack that was killed are still registered for a while: look for ours.
        return answer.is_success and registered.issuperset(self.worker_pids())


def _environment(settings: WorkerSettings) -> dict[str, str]:
    """The variables from which the children read the settings that were set here."""
    return {
        f"MESHCONE_{name.upper()}": str(getattr(settings, name))
        for name in sorted(settings.model_fields_set)
        if getattr(settings, name) is not None
    }
