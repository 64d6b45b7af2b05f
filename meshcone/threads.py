"""One thread in the numeric libraries, so that the same files give the same bytes.

Sums split over threads are rounded in another order for each number of threads, and
rounds of correspondences make a visible difference of it. One thread is also the fastest
choice where a machine runs one worker per core.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager

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
    """
    from threadpoolctl import threadpool_limits

    if any(variable in os.environ for variable in _THREAD_VARIABLES):
        yield
        return
    with threadpool_limits(limits=1):
        yield
