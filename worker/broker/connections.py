"""Connections to the broker."""

from __future__ import annotations

from typing import TYPE_CHECKING

from redis import Redis
from redis.asyncio import Redis as AsyncRedis

if TYPE_CHECKING:
    from redis.client import Redis as RedisClient

CONNECT_TIMEOUT = 5.0  # seconds
REPLY_TIMEOUT = 15.0  # seconds; no command of the ledger blocks


def connect_text(url: str) -> RedisClient:
    """A client whose replies are strings, as the ledger wants them."""
    return Redis.from_url(
        url,
        decode_responses=True,
        socket_connect_timeout=CONNECT_TIMEOUT,
        socket_timeout=REPLY_TIMEOUT,
    )


def connect_async(url: str, connections: int = 100) -> AsyncRedis:
    """A client for an event loop, whose replies are strings.

    Args:
        url: the broker.
        connections: how many it may have at one time; one more is an error, not a wait.
    """
    return AsyncRedis.from_url(
        url,
        max_connections=connections,
        decode_responses=True,
        socket_connect_timeout=CONNECT_TIMEOUT,
        socket_timeout=REPLY_TIMEOUT,
    )


def connect_bytes(url: str) -> RedisClient:
    """A client whose replies are bytes, as RQ wants them; RQ sets its own reply timeout."""
    return Redis.from_url(url, socket_connect_timeout=CONNECT_TIMEOUT)
