"""How many processes a refinement may use at once: what a machine has, not what a job asks for.

Nothing that is computed depends on it. Forked processes see what their parent has in memory, so
that nothing large is sent to them. Only on Linux can a process that has loaded numeric libraries
be relied on to fork; elsewhere the work is done one after the other.

They end with their parent, and as soon as it has no use for them: at an error, at an interrupt, or
when no more answers are asked for.
"""

from __future__ import annotations

import itertools
import multiprocessing
import os
import signal
import sys
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import TypeVar

from meshcone.errors import CrashError
from meshcone.lifeline import die_with_parent

T = TypeVar("T")

_allowed: ContextVar[int] = ContextVar("processes", default=1)
_tokens = itertools.count()
_work: dict[int, Callable[[int], object]] = {}  # what forked processes find in their memory


def at_once() -> int:
    """Return how many processes may be used at once."""
    return _allowed.get() if sys.platform == "linux" else 1


@contextmanager
def processes_allowed(count: int) -> Iterator[None]:
    """Let the body use so many processes at once."""
    token = _allowed.set(count)
    try:
        yield
    finally:
        _allowed.reset(token)


def each_of(count: int, work: Callable[[int], T]) -> Generator[T]:
    """Yield ``work(0)``, ``work(1)`` and so on, done in as many processes as are allowed.

    Args:
        count: how many there are.
        work: what it returns or raises can be pickled; it changes nothing outside of itself.

    Raises:
        CrashError: a process died.
    """
    used = min(at_once(), count)
    if used <= 1:
        yield from map(work, range(count))
        return
    from meshcone.scratch import scratch  # POSIX alone has what it needs

    token = next(_tokens)
    _work[token] = work
    try:
        with scratch() as place, _pool(used, place) as pool:
            for task in [pool.submit(_do, token, index) for index in range(count)]:
                yield task.result()  # type: ignore[misc]
    except BrokenProcessPool:
        raise CrashError(
            f"one of {used} processes that worked on parts of the mesh died; fewer at once take "
            "less memory"
        ) from None
    finally:
        del _work[token]


@contextmanager
def _pool(count: int, place: Path | None) -> Iterator[ProcessPoolExecutor]:
    """Processes that are killed where the body does not come to its end."""
    forking = multiprocessing.get_context("fork")
    pool = ProcessPoolExecutor(
        count, mp_context=forking, initializer=_begin, initargs=(os.getpid(), place)
    )
    try:
        yield pool
    except BaseException:
        # The executor itself would wait for all that has begun.
        begun = list((pool._processes or {}).values())
        pool.shutdown(wait=False, cancel_futures=True)
        for process in begun:
            process.kill()
        raise
    pool.shutdown()


def _begin(parent: int, place: Path | None) -> None:
    """Make a process of a pool one that its parent rules."""
    from meshcone.scratch import work_in

    die_with_parent(parent, signal.SIGKILL)
    # A Ctrl-C in a terminal goes to all; the executor would take it for the answer of a task.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    work_in(place)


def _do(token: int, index: int) -> object:
    _allowed.set(1)  # a process has no others at its side
    return _work[token](index)
