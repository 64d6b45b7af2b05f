"""Waiting until what was written outlives the broker."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from redis.exceptions import ResponseError
from redis.exceptions import TimeoutError as RedisTimeoutError

if TYPE_CHECKING:
    from redis import Redis
    from redis.commands.core import Script

logger = logging.getLogger(__name__)

_PATIENCE = 5000  # milliseconds; a broker that writes once a second needs one, a slow disk more


class DurableWrites:
    """Runs scripts whose effects are on the broker's disk when they return (WAITAOF).

    Args:
        client: a connection to the broker.
    """

    def __init__(self, client: Redis) -> None:
        self._client = client
        self._warned = False

    def run(self, script: Script, keys: Sequence[str], arguments: Sequence[str]) -> Any:
        """Run a script and return its answer.

        A broker that keeps nothing on disk cannot promise anything; the log says so, once.

        Raises:
            redis.TimeoutError: it was run, but is not on the disk in time.
        """
        pipeline = self._client.pipeline(transaction=False)  # WAITAOF is about its connection
        script(keys, arguments, client=pipeline)
        pipeline.execute_command("WAITAOF", 1, 0, _PATIENCE)
        answer, written = pipeline.execute(raise_on_error=False)
        if isinstance(answer, Exception):
            raise answer
        if isinstance(written, ResponseError):
            self._warn(written)
        elif isinstance(written, Exception):
            raise written
        elif not written[0]:
            raise RedisTimeoutError("the broker has not written to its disk in time")
        return answer

    def _warn(self, error: ResponseError) -> None:
        if not self._warned:
            logger.warning("the broker does not keep jobs on disk: %s", error)
            self._warned = True
