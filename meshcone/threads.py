"""One thread in the numeric libraries, so that the same files give the same bytes.

Sums split over threads are rounded in another order for each number of threads, and
rounds of correspondences make a visible difference of it. One thread is also the fastest
choice where a machine runs one worker per core.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Literal

_THREAD_VARIABLES = (
    "OPENBLAS_NUM_THREADS",
    "OMP_NUM_THREADS",
    "MKL_NUM_THREADS",
    "NUMEXPR_NUM_THREADS",
)


def use_one_thread() -> None:
    """Ask for one thread where the environment asks for nothing else.

    To be called before numpy is imported: the libraries read their variables only then.
    """
    for variable in _THREAD_VARIABLES:
        os.environ.setdefault(variable, "1")


@contextmanager
def one_thread() -> Iterator[None]:
    """Have the numeric libraries that are loaded use one thread for a while.

    For a program that imported numpy before it came here. What the environment asks for stays.
    Several threads may be in such a while at one time; the libraries have as many threads as
    before when the last of them is out.
    """
    if any(variable in os.environ for variable in _THREAD_VARIABLES):
        yield
        return
    # OpenMP has a number of threads for each thread, what multiplies matrices one for all.
    with _limited("openmp"):
        _enter()
        try:
            yield
        finally:
            _leave()


_lock = threading.Lock()
_inside = 0
_limits: list[Any] = []


def _limited(kind: Literal["openmp", "blas"]) -> Any:
    """Limit the libraries of a kind that are loaded, until it is left or told to restore them."""
    from threadpoolctl import ThreadpoolController

    # A limit on one kind of all libraries would restore the others too.
    return ThreadpoolController().select(user_api=kind).limit(limits=1)


def _enter() -> None:
    global _inside
    with _lock, _in_control():
        # Also where somebody is in already: a library may have been loaded since.
        _limits.append(_limited("blas"))
        _inside += 1


def _leave() -> None:
    global _inside
    with _lock, _in_control():
        _inside -= 1
        while _limits and not _inside:  # the first, which knows how it was before all, is the last
            _limits.pop().restore_original_limits()


@contextmanager
def _in_control() -> Iterator[None]:
    """Let this thread set what another has set.

    threadpoolctl ignores all threads but the one that set OpenBLAS first; here they take turns.
    """
    from threadpoolctl import OpenBLASController

    OpenBLASController.clear_controlling_thread(force=True)
    try:
        yield
    finally:
        OpenBLASController.clear_controlling_thread(force=True)
