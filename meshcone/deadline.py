"""The moment by which a refinement must have its answer, known to every method that iterates."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from time import monotonic

from meshcone.errors import SolveTimeoutError

_Limit = tuple[float, float]  # the clock's reading at the end, and the seconds it was set to
_limit: ContextVar[_Limit | None] = ContextVar("limit", default=None)


@contextmanager
def time_allowed(seconds: float) -> Iterator[None]:
    """Bound what the body may take; 0 means no bound."""
    token = _limit.set((monotonic() + seconds, seconds) if seconds > 0 else None)
    try:
        yield
    finally:
        _limit.reset(token)


def require_time() -> None:
    """Go on only while there is time: asked before each step that cannot be interrupted.

    Raises:
        SolveTimeoutError: the time allowed is over.
    """
    seconds_left()


def seconds_left() -> float:
    """Return the seconds left, above 0; 0 means no bound.

    Raises:
        SolveTimeoutError: the time allowed is over.
    """
    limit = _limit.get()
    if limit is None:
        return 0.0
    end, seconds = limit
    left = end - monotonic()
    if left <= 0:
        raise SolveTimeoutError(f"the solver did not finish within {seconds:g} s")
    return left
