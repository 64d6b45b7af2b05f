"""Processes of this program that are kept running."""

from __future__ import annotations

import logging
import signal
import subprocess
import sys
import time
from collections import deque
from collections.abc import Mapping, Sequence
from pathlib import Path

from meshcone.errors import InternalError
from worker.lifeline import tied_command

logger = logging.getLogger(__name__)

STARTS_ALLOWED = 5
START_WINDOW = 30.0  # seconds; a child that ends more often than this cannot work at all


class Child:
    """A command of this program, in a process that ends with this one, however that ends.

    Args:
        name: what to call it in messages.
        arguments: the command and its arguments.
        environment: its whole environment.
        log: file it writes to, instead of this process's stderr.
        fds: open files it inherits.

    Attributes:
        process: the one that runs, or ran last.
    """

    def __init__(
        self,
        name: str,
        arguments: Sequence[str],
        *,
        environment: Mapping[str, str],
        log: Path | None,
        fds: Sequence[int] = (),
    ) -> None:
        self.name = name
        self._arguments = arguments
        self._environment = environment
        self._log = log
        self._fds = fds
        self._starts: deque[float] = deque(maxlen=STARTS_ALLOWED)
        self.process = self._start()

    def has_ended(self) -> bool:
        """Whether its process is gone."""
        return self.process.poll() is not None

    def mend(self) -> None:
        """Start it again if it has ended.

        Raises:
            InternalError: it keeps ending.
        """
        if not self.has_ended():
            return
        if len(self._starts) == STARTS_ALLOWED and self._starts[0] > _now() - START_WINDOW:
            raise InternalError(f"the {self.name} keeps ending; see its log")
        logger.error("the %s ended (%s); starting it again", self.name, self.process.returncode)
        self.process = self._start()

    def _start(self) -> subprocess.Popen[bytes]:
        self._starts.append(_now())
        log = self._log.open("ab") if self._log else None
        try:
            return subprocess.Popen(  # noqa: S603 - our own program
                tied_command(
                    [sys.executable, "-m", "service.cli", *self._arguments], signal.SIGKILL
                ),
                env=dict(self._environment),
                pass_fds=self._fds,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                # Ctrl-C in a terminal is for the parent alone, which stops them in order.
                start_new_session=True,
            )
        finally:
            if log is not None:
                log.close()


def end(children: Sequence[Child], *patience: float) -> None:
    """Ask children to end, once for each wait in seconds, and kill those that do not."""
    for seconds in patience:
        for child in children:
            child.process.terminate()
        deadline = _now() + seconds
        for child in children:
            try:
                child.process.wait(max(0.0, deadline - _now()))
            except subprocess.TimeoutExpired:
                continue
    for child in children:
        if not child.has_ended():
            child.process.kill()
            child.process.wait()


def _now() -> float:
    return time.monotonic()
