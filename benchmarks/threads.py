"""How many threads and processors a measurement may use."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

# Each is read by one library when it is loaded. The product keeps these at one thread, where
# vectors are too short to share, and leaves libigl's queries every processor there is.
_SINGLE = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def thread_environment(count: int) -> dict[str, str]:
    """This process's environment, with so many threads in what the product lets have several."""
    return os.environ | dict.fromkeys(_SINGLE, "1") | {"IGL_NUM_THREADS": str(count)}


def limit_threads(count: int) -> None:
    """Give libraries loaded from here on, here and in child processes, so many threads."""
    os.environ.update(thread_environment(count))


@contextmanager
def processors(count: int) -> Iterator[None]:
    """Keep this process, and what it starts, on some processors, where the system can."""
    if not hasattr(os, "sched_getaffinity"):
        yield
        return
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, sorted(before)[:count])
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)
