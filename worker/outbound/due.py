"""What is to be tried, and when: kept in the broker, so that nothing is forgotten.

Each name has a time at which it is due. Who takes one moves its time on; if that process dies,
the name is due again. So everything is tried at least once.
"""

from __future__ import annotations

import asyncio
import random
from collections.abc import Callable, Coroutine, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import structlog
from redis.exceptions import RedisError

if TYPE_CHECKING:
    from redis.asyncio import Redis

logger = structlog.get_logger(__name__)

Item = TypeVar("Item")
Item_co = TypeVar("Item_co", covariant=True)

TAKEN = 15.0
"""Seconds after which a name is due again if the process that has taken it has died."""

_RENEWAL = 5.0  # seconds between two signs of life of that process
_JITTER = 0.2  # share of a pause, so that what failed together is not tried together
_LOOK_INTERVAL = 5.0  # seconds
_FULL_PAUSE = 0.1  # seconds
_BROKER_PAUSE = 1.0  # seconds

_NOW = """
local time = redis.call('TIME')
local now = tonumber(time[1]) + tonumber(time[2]) / 1e6
"""

_TAKE = (
    _NOW
    + """
-- ARGV: names at most, seconds they are taken for
local taken = {}
for _, name in ipairs(redis.call('ZRANGEBYSCORE', KEYS[1], '-inf', string.format('%.6f', now),
                                 'LIMIT', 0, ARGV[1])) do
  redis.call('ZADD', KEYS[1], string.format('%.6f', now + tonumber(ARGV[2])), name)
  taken[#taken + 1] = {name, redis.call('HINCRBY', KEYS[2], name, 1)}
end
return taken
"""
)

_POSTPONE = (
    _NOW
    + """
-- ARGV: name, seconds
redis.call('ZADD', KEYS[1], 'XX', string.format('%.6f', now + tonumber(ARGV[2])), ARGV[1])
"""
)

_GIVE_BACK = """
-- ARGV: name
if redis.call('ZADD', KEYS[1], 'XX', 'CH', 0, ARGV[1]) == 1 then
  redis.call('HINCRBY', KEYS[2], ARGV[1], -1)
end
"""

_UNTIL_NEXT = (
    _NOW
    + """
local first = redis.call('ZRANGE', KEYS[1], 0, 0, 'WITHSCORES')
return first[2] and tostring(tonumber(first[2]) - now) or ''
"""
)


@dataclass(frozen=True)
class Due:
    """A name whose time has come.

    Attributes:
        tries: how often it has been taken, this time included.
    """

    name: str
    tries: int


class DueList:
    """Names of an installation and their times; any number of processes may take them.

    Args:
        client: a connection whose replies are strings.
        times: key of the sorted set of names by the time at which they are due.
        tries: key of the hash of how often each has been taken.
    """

    def __init__(self, client: Redis, times: str, tries: str) -> None:
        self._client = client
        self._keys = (times, tries)
        self._take = client.register_script(_TAKE)
        self._postpone = client.register_script(_POSTPONE)
        self._give_back = client.register_script(_GIVE_BACK)
        self._until_next = client.register_script(_UNTIL_NEXT)

    async def take(self, count: int, seconds: float = TAKEN) -> Sequence[Due]:
        """Up to ``count`` names that are due; nobody else gets them for some seconds."""
        answer = await self._take(keys=self._keys, args=[count, seconds])
        return [Due(str(name), int(tries)) for name, tries in answer]

    async def postpone(self, name: str, seconds: float) -> None:
        """Have a name due some seconds from now."""
        await self._postpone(keys=self._keys, args=[name, seconds])

    async def hold(
        self, name: str, work: Coroutine[Any, Any, None], stopping: asyncio.Event
    ) -> None:
        """Do the work on a name that was taken, which stays so however long that lasts.

        The work is left off where somebody has the name due no more; and where this process is to
        stop: the name is then due at once, as if it had not been taken. What the work raises is
        raised.
        """
        task = asyncio.create_task(work)
        stopped = asyncio.create_task(stopping.wait())
        try:
            while not task.done():
                await asyncio.wait(
                    {task, stopped}, timeout=_RENEWAL, return_when=asyncio.FIRST_COMPLETED
                )
                if task.done():
                    break
                if stopped.done():
                    await self.give_back(name)
                    return
                with suppress(RedisError):
                    if await self._client.zscore(self._keys[0], name) is None:
                        return
                    if task.done():  # it may have had the name postponed for longer
                        break
                    await self.postpone(name, TAKEN)
            await task
        finally:
            for each in (task, stopped):
                each.cancel()
            with suppress(asyncio.CancelledError, Exception):
                await task

    async def forget(self, name: str) -> None:
        """Have a name due no more."""
        async with self._client.pipeline(transaction=True) as pipeline:
            pipeline.zrem(self._keys[0], name)
            pipeline.hdel(self._keys[1], name)
            await pipeline.execute()

    async def give_back(self, name: str) -> None:
        """Have a name due now, as if it had not been taken."""
        await self._give_back(keys=self._keys, args=[name])

    async def seconds_until_next(self, most: float) -> float:
        """Seconds until a name is due, a little at least and ``most`` at most."""
        due = await self._until_next(keys=self._keys, args=[])
        return min(most, max(float(due), 0.01)) if due else most


def pause_before(tries: int, first: float, growth: float) -> float:
    """Seconds before the next try, after so many: ``first``, then each ``growth`` times the last.

    A little more or less, by chance.
    """
    spread = 1 + random.uniform(-_JITTER, _JITTER)  # noqa: S311 - nothing is kept secret by it
    return first * growth ** (tries - 1) * spread


class Supply(Protocol[Item_co]):
    """Where there is something to do, time and again."""

    async def take(self, count: int) -> Sequence[Item_co]:
        """Up to ``count`` of what there is to do now."""

    async def wait(self, seconds: float) -> None:
        """Wait until there may be more to do, some seconds at most."""


async def work_through(
    supply: Supply[Item],
    work: Callable[[Item], Coroutine[Any, Any, None]],
    stopping: asyncio.Event,
    at_once: int,
) -> None:
    """Do what there is to do, ``at_once`` at a time, until stopping; then end what is begun.

    A broker that is away is waited for.
    """
    begun: set[asyncio.Task[None]] = set()
    stopped = asyncio.create_task(stopping.wait())

    while not stopping.is_set():
        for item in await _taken(supply, at_once - len(begun)):
            task = asyncio.create_task(work(item))
            begun.add(task)
            task.add_done_callback(begun.discard)
        waiting = asyncio.create_task(_waited(supply, full=len(begun) >= at_once))
        await asyncio.wait({stopped, waiting}, return_when=asyncio.FIRST_COMPLETED)
        waiting.cancel()
        with suppress(asyncio.CancelledError):
            await waiting
    await asyncio.gather(*begun)


async def _taken(supply: Supply[Item], count: int) -> Sequence[Item]:
    if count <= 0:
        return ()
    try:
        return await supply.take(count)
    except RedisError as error:
        logger.error("the broker cannot be used", error=str(error))
        await asyncio.sleep(_BROKER_PAUSE)
        return ()


async def _waited(supply: Supply[Item], *, full: bool) -> None:
    if full:
        await asyncio.sleep(_FULL_PAUSE)
        return
    try:
        await supply.wait(_LOOK_INTERVAL)
    except RedisError:
        await asyncio.sleep(_BROKER_PAUSE)
