"""A limit on the time a piece of work may take."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


class TimeLimitReached(BaseException):
    """The time is over. No ``except Exception`` of a library is to swallow it."""


@contextmanager
def time_limit(seconds: float) -> Iterator[None]:
    """Interrupt the body after a time, by a signal, in the main thread only.

    Python runs a signal's handler between two of its own instructions, so C code that
    never returns is not interrupted; the worker kills the process then.

    Raises:
        TimeLimitReached: in the body.
    """

    def stop(_number: int, _frame: FrameType | None) -> None:
        raise TimeLimitReached

    previous = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, previous)
