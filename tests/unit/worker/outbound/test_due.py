"""When what failed is tried again, and how what is due is worked through."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, cast

import pytest
from redis.asyncio import Redis
from redis.exceptions import ConnectionError as RedisConnectionError

from worker.outbound import due
from worker.outbound.due import DueList, pause_before, work_through


def test_each_pause_is_so_many_times_the_one_before() -> None:
    pauses = [pause_before(tries, 5.0, 6.0) for tries in (1, 2, 3)]

    for pause, expected in zip(pauses, (5.0, 30.0, 180.0), strict=True):
        assert 0.8 * expected <= pause <= 1.2 * expected


@dataclass
class Numbers:
    """Gives out numbers; the broker behind it fails once at first."""

    left: list[int]
    asked: list[int] = field(default_factory=list)
    has_failed: bool = False

    async def take(self, count: int) -> Sequence[int]:
        if not self.has_failed:
            self.has_failed = True
            raise RedisConnectionError
        self.asked.append(count)
        taken, self.left = self.left[:count], self.left[count:]
        return taken

    async def wait(self, _seconds: float) -> None:
        await asyncio.sleep(0)


def test_no_more_is_begun_than_may_be_and_what_is_begun_is_ended() -> None:
    numbers, done, at_work, most = Numbers(list(range(7))), [], 0, 0

    async def run() -> None:
        stopping = asyncio.Event()

        async def work(number: int) -> None:
            nonlocal at_work, most
            at_work += 1
            most = max(most, at_work)
            await asyncio.sleep(0.01)
            at_work -= 1
            done.append(number)
            if number == 6:
                stopping.set()

        await work_through(numbers, work, stopping, at_once=3)

    asyncio.run(run())

    assert sorted(done) == list(range(7))
    assert most == 3
    assert max(numbers.asked) == 3


class Broker:
    """Has every name due, and says so only when the work on it has ended."""

    def __init__(self, ended: asyncio.Event) -> None:
        self._ended = ended
        self.asked = asyncio.Event()
        self.postponed: list[Any] = []

    def register_script(self, _script: str) -> Callable[..., Awaitable[None]]:
        async def run(**asked: Any) -> None:
            self.postponed.append(asked["args"])

        return run

    async def zscore(self, _key: str, _name: str) -> float:
        self.asked.set()
        await self._ended.wait()
        return 1.0


def test_work_that_ends_while_it_is_looked_after_keeps_the_pause_it_has_set(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(due, "_RENEWAL", 0.001)

    async def run() -> list[Any]:
        ended = asyncio.Event()
        broker = Broker(ended)
        names = DueList(cast("Redis", broker), "times", "tries")

        async def work() -> None:
            await broker.asked.wait()
            await names.postpone("mug", 180.0)
            ended.set()

        await names.hold("mug", work(), asyncio.Event())
        return broker.postponed

    assert asyncio.run(run()) == [["mug", 180.0]]
