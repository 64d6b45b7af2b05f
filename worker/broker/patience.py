"""Waiting for a broker that is away, or takes nothing in for a while."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, TypeVar

from redis.exceptions import ConnectionError as RedisConnectionError
from redis.exceptions import OutOfMemoryError, ReadOnlyError, RedisError
from redis.exceptions import TimeoutError as RedisTimeoutError

if TYPE_CHECKING:
    from redis import Redis

logger = logging.getLogger(__name__)

Result = TypeVar("Result")

PATIENCE = 60.0  # seconds; a broker that loads a long append-only file takes that long
_FIRST_PAUSE = 0.05  # seconds
_LONGEST_PAUSE = 1.0

_PASSING = (RedisConnectionError, RedisTimeoutError, OutOfMemoryError, ReadOnlyError)
"""What a broker answers for a while: it is away, full, or a replica that will be promoted."""

_PASSING_CODES = ("MISCONF ", "NOREPLICAS ")
"""The same for which the client has no class: its disk is full, its replicas are away."""


def patiently(step: Callable[[], Result], patience: float = PATIENCE) -> Result:
    """Take a step of the ledger, again and again while the broker cannot be used.

    A step whose answer was lost may have been taken: the repetition is then refused, as
    every step is that names a state or an attempt the job has left.

    Raises:
        RedisError: the broker was away for too long, or says that the step itself is wrong.
    """
    deadline = time.monotonic() + patience
    pause = _FIRST_PAUSE
    while True:
        try:
            return step()
        except RedisError as error:
            if not will_pass(error) or time.monotonic() + pause > deadline:
                raise
            logger.warning("the broker cannot be used, trying again: %s", error)
        time.sleep(pause)
        pause = min(2 * pause, _LONGEST_PAUSE)


def will_pass(error: RedisError) -> bool:
    """Whether the broker may take the same command a moment later."""
    return isinstance(error, _PASSING) or str(error).startswith(_PASSING_CODES)


class OutageLog:
    """Says once that the broker is away, and once that it is back."""

    def __init__(self) -> None:
        self._since: float | None = None

    def is_away(self, error: RedisError) -> None:
        """Note that a command failed."""
        if self._since is None:
            self._since = time.monotonic()
            logger.error("the broker cannot be used, waiting for it: %s", error)

    def is_back(self) -> None:
        """Note that a command was answered."""
        if self._since is not None:
            logger.info("the broker is back after %.1f s", time.monotonic() - self._since)
            self._since = None


def wait_for_broker(client: Redis, until: Callable[[], bool]) -> None:
    """Wait until the broker answers, or a condition holds."""
    outage = OutageLog()
    while not until():
        try:
            client.ping()
        except RedisError as error:
            outage.is_away(error)
            time.sleep(_LONGEST_PAUSE)
        else:
            outage.is_back()
            return
