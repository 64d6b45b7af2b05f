"""What waits to be told by a webhook: entries that cannot be read, and more than are kept."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest
from redis import Redis
from standardwebhooks import Webhook

from tests.integration.receiver import Receiver
from tests.integration.telling import SECRET, Deliver, ended_job, is_settled, log_lines
from tests.integration.waiting import wait_for
from worker.broker.connections import connect_async
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.ledger import Ledger
from worker.jobs.ledger_keys import WEBHOOKS
from worker.jobs.outbox import KEPT
from worker.webhooks.schedule import DUE, MESSAGES, Schedule


@pytest.fixture
def broker(own_broker: EmbeddedBroker) -> EmbeddedBroker:
    """One for each test: a message left by one would be delivered in the next."""
    return own_broker


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"labels":"[]","milliseconds":1e300}'])
def test_a_message_that_cannot_be_read_is_dropped_and_stops_no_other(
    ledger: Ledger, redis: Redis, receiver: Receiver, deliver: Deliver, text: str
) -> None:
    redis.hset(MESSAGES, "broken", text)
    redis.zadd(DUE, {"broken": 0})
    ended_job(ledger, receiver.url)

    with deliver():
        receiver.wait_for(1)
        wait_for(lambda: is_settled(redis))

    assert ledger.index.counters()["webhooks:dropped"] == 1


def test_an_entry_of_an_older_version_is_looked_up_or_dropped_in_words(
    ledger: Ledger, redis: Redis, receiver: Receiver, deliver: Deliver, tmp_path: Path
) -> None:
    kept, deleted = (ended_job(ledger, receiver.url) for _ in range(2))
    ledger.delete(deleted.id)
    redis.delete(WEBHOOKS)
    for record in (deleted, kept):
        for state, attempt in (("queued", 0), ("running", 1), ("succeeded", 1)):
            entry = {"job": record.id, "state": state, "attempt": attempt}
            redis.xadd(WEBHOOKS, {name: str(value) for name, value in entry.items()})
    redis.xadd(WEBHOOKS, {"what": "is this"})

    with deliver():
        receiver.wait_for(1)
        wait_for(lambda: is_settled(redis))

    [(headers, body)] = receiver.received
    assert Webhook(SECRET).verify(body, headers)["data"]["id"] == kept.id
    assert headers["webhook-id"] == f"{kept.id}_succeeded_1"
    dropped = [line for line in log_lines(tmp_path) if line["event"] == "webhook dropped"]
    assert dropped[0]["reason"] == f"{deleted.id}: its job has been deleted"
    assert len(dropped) == 2
    assert ledger.index.counters()["webhooks:dropped"] == 2


def test_what_falls_out_of_a_full_outbox_is_counted(ledger: Ledger, redis: Redis) -> None:
    with redis.pipeline(transaction=False) as pipeline:
        for _ in range(KEPT):
            pipeline.xadd(WEBHOOKS, {"job": "old", "state": "succeeded", "attempt": "1"})
        pipeline.execute()

    record = ended_job(ledger, "https://example.org/hook")

    assert redis.xlen(WEBHOOKS) == KEPT
    assert redis.xrevrange(WEBHOOKS, count=1)[0][1]["job"] == record.id
    assert ledger.index.counters()["webhooks:dropped"] == 1


def test_of_too_many_those_go_first_that_are_tried_again_last(
    broker: EmbeddedBroker, ledger: Ledger, redis: Redis
) -> None:
    later = 4e9  # seconds
    redis.zadd(DUE, {f"waits-{number}": later + number for number in range(KEPT)})
    record = ended_job(ledger, "https://example.org/hook")

    async def collect() -> None:
        async with connect_async(broker.url) as client:
            await Schedule(client).collect()

    asyncio.run(collect())

    assert redis.zcard(DUE) == KEPT
    assert redis.zscore(DUE, f"{record.id}_succeeded_1") is not None
    assert redis.zscore(DUE, f"waits-{KEPT - 1}") is None
    assert ledger.index.counters()["webhooks:dropped"] == 1
