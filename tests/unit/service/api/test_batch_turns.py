"""Who waits for the result of a batch holds up nobody else."""

from __future__ import annotations

import asyncio
import threading
from types import SimpleNamespace
from typing import Any

import pytest
from anyio import CapacityLimiter, to_thread

from service.api import batch_results

READERS = 50  # more than there are threads for all requests that need one


def test_requests_that_wait_for_a_result_take_no_threads_of_others(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    may_end, writing = threading.Event(), list[int]()
    monkeypatch.setattr(batch_results, "result_of", lambda _batch, _context: None)

    def written(_run: Any) -> bytes:
        writing.append(1)
        may_end.wait(30)
        return b"{}"

    async def read_beside_many() -> tuple[str, int, list[bytes]]:
        context: Any = SimpleNamespace(result_turns=CapacityLimiter(1))
        batch: Any = None
        readers = [
            asyncio.create_task(batch_results.write_result(batch, context, written))
            for _ in range(READERS)
        ]
        try:
            async with asyncio.timeout(20):
                while not writing:
                    await asyncio.sleep(0.01)
                answer = await to_thread.run_sync(lambda: "alive")
                at_once = len(writing)
        finally:
            may_end.set()
        return answer, at_once, await asyncio.gather(*readers)

    assert asyncio.run(read_beside_many()) == ("alive", 1, [b"{}"] * READERS)
