"""When what failed is tried again, and how what is due is worked through."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import dataclass, field

from redis.exceptions import ConnectionError as RedisConnectionError

from worker.outbound.due import pause_before, work_through


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
