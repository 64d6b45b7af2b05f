"""A work horse: a forked process that runs one attempt of a job."""

from __future__ import annotations

import logging
import os
import select
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Self

from meshcone.lifeline import die_with_parent

MAXRSS_UNIT = 1 if sys.platform == "darwin" else 1024  # bytes; getrusage(2) of each


@dataclass(frozen=True)
class Death:
    """How a process ended.

    Attributes:
        code: its exit code, if it ended itself.
        signal: what killed it, if it did not.
        peak_memory: bytes it held at once at most, those of its worker included.
    """

    code: int | None
    signal: signal.Signals | None
    peak_memory: int = field(default=0, compare=False)

    @classmethod
    def of(cls, status: int, peak_memory: int) -> Self:
        """Read a status of ``waitpid``."""
        code = os.waitstatus_to_exitcode(status)
        if code >= 0:
            return cls(code, None, peak_memory)
        return cls(None, signal.Signals(-code), peak_memory)


class Horse:
    """The worker's side of a horse: it can be waited for and killed, with what it started.

    A horse does not outlive its worker: a second run of the job would otherwise start
    while the first still goes on, with nobody to enforce its limits.
    """

    def __init__(self, pid: int, lifeline: int) -> None:
        self.pid = pid
        self._lifeline = lifeline
        self._death: Death | None = None

    @classmethod
    def start(cls, work: Callable[[], int]) -> Self:
        """Fork a process that does ``work`` and exits with the code it returns."""
        worker_pid = os.getpid()
        # The kernel closes the writing end when the horse ends, however it ends: that wakes
        # the worker at once, which neither a timer nor a signal does without races.
        reading, writing = os.pipe()
        pid = os.fork()
        if pid == 0:
            os.close(reading)
            _become_horse(worker_pid, work)
        os.close(writing)
        with suppress(ProcessLookupError, PermissionError):  # both do it: neither has to be first
            os.setpgid(pid, pid)
        return cls(pid, reading)

    def wait(self, seconds: float) -> Death | None:
        """How it ended, or None if it has not within a time."""
        if self._death is None:
            ended, _, _ = select.select([self._lifeline], [], [], seconds)
            if ended:
                self._reap()
        return self._death

    def kill(self) -> Death:
        """End it and wait until it has ended."""
        if self._death is None:
            self._reap()
        assert self._death is not None  # noqa: S101 - for the type checker
        return self._death

    def _reap(self) -> None:
        # Its group holds what it started, such as a decoder. Nobody has waited for the horse
        # yet, so the id cannot have become another's.
        with suppress(ProcessLookupError):
            os.killpg(self.pid, signal.SIGKILL)
        _, status, usage = os.wait4(self.pid, 0)
        os.close(self._lifeline)
        self._death = Death.of(status, usage.ru_maxrss * MAXRSS_UNIT)


def _become_horse(worker_pid: int, work: Callable[[], int]) -> None:
    code = os.EX_SOFTWARE
    try:
        die_with_parent(worker_pid, signal.SIGKILL)
        # A Ctrl-C in a terminal is for the worker, which decides what becomes of the job.
        os.setpgid(0, 0)
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        code = work()
    except BaseException:  # the horse's outermost frame: what escapes is a crash, and is logged
        logging.getLogger(__name__).exception("the work horse crashed")
    finally:
        # The worker's exit handlers and open files are not the horse's to close, and nothing
        # may let it return into the worker's code.
        try:
            sys.stderr.flush()
        finally:
            os._exit(code)
