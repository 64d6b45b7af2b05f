"""Processes of this program that are kept running."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from meshcone.lifeline import tied_command
from service.stack.restarts import Restarts


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
        restarts: starts it again when it has ended.
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
        self.process = self._started()
        self.restarts = Restarts(name, self._start, self._ending)

    @property
    def code(self) -> int | None:
        """Its exit code, or the negative number of the signal that ended it; None if it runs."""
        return self.process.poll()

    def _start(self) -> None:
        self.process = self._started()

    def _ending(self) -> str | None:
        if self.code is None:
            return None
        return f"exit code {self.code}" if self.code >= 0 else signal.strsignal(-self.code)

    def _started(self) -> subprocess.Popen[bytes]:
        log = self._log.open("ab") if self._log else None
        try:
            return subprocess.Popen(  # noqa: S603 - our own program
                tied_command(
                    [sys.executable, "-P", "-m", "service.cli", *self._arguments], signal.SIGKILL
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
        deadline = time.monotonic() + seconds
        for child in children:
            try:
                child.process.wait(max(0.0, deadline - time.monotonic()))
            except subprocess.TimeoutExpired:
                continue
    for child in children:
        if child.code is None:
            child.process.kill()
            child.process.wait()
