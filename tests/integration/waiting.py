"""Waiting, but not for ever."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

import httpx2
from redis.exceptions import ConnectionError as RedisConnectionError

from service.client import ServiceError

Answer = TypeVar("Answer")

PATIENCE = 120.0
"""Seconds after which a test gives up: a guard against waiting for ever, on a busy machine too.

What an installation promises is some ten seconds, on one that has room.
"""


def wait_for(
    condition: Callable[[], bool], seconds: float = PATIENCE, *, pause: float = 0.02
) -> None:
    """Wait until a condition holds, and fail if it does not in time."""
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "it did not happen in time"
        time.sleep(pause)


def insist(call: Callable[[], Answer], seconds: float = PATIENCE) -> Answer:
    """Ask a service, or its broker, that may be away for a time.

    Who repeats a request by its key may be told that the first is still under way: the API
    that was killed over it cannot say otherwise.
    """
    deadline = time.monotonic() + seconds
    while True:
        try:
            return call()
        except (httpx2.TransportError, RedisConnectionError):
            assert time.monotonic() < deadline, "nobody answered in time"
        except ServiceError as error:
            if error.problem.status not in (409, 503):
                raise
            assert time.monotonic() < deadline, "the service was unavailable for too long"
        time.sleep(0.1)
