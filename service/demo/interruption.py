"""Ctrl-C and SIGTERM: both interrupt, until stopping has begun."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager

from worker.run.stopping import StopRequest

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


def allow() -> None:
    """From now on, either signal raises ``KeyboardInterrupt``."""
    for number in _SIGNALS:
        signal.signal(number, signal.default_int_handler)


def ignore() -> None:
    """From now on, neither signal does anything: a second Ctrl-C must not disturb stopping."""
    for number in _SIGNALS:
        signal.signal(number, signal.SIG_IGN)


@contextmanager
def interruptible() -> Iterator[None]:
    """Allow both signals within; in the end, put back what they did before."""
    before = {number: signal.getsignal(number) for number in _SIGNALS}
    allow()
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def deferred(request: StopRequest) -> Iterator[None]:
    """Interrupt at the end rather than in between.

    An interruption between the making of a process or a directory and the noting of it would
    leave it behind.

    Args:
        request: what notes a signal when it arrives.

    Raises:
        KeyboardInterrupt: in the end, if a signal arrived.
    """
    request.listen()
    try:
        yield
    finally:
        allow()
    if request.made:
        raise KeyboardInterrupt
