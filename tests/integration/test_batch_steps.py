"""A batch is entered whole or not at all, whatever dies."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from datetime import UTC, datetime
from itertools import islice
from pathlib import Path

import pytest
from redis import Redis

from tests.integration.jobs import make_job
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.batches import STAGED_SECONDS, Batches, BatchRecord, carry_through
from worker.jobs.errors import (
    KeyReusedError,
    QueueFullError,
    StagedJobsLostError,
    UnknownBatchError,
)
from worker.jobs.filters import JobFilter
from worker.jobs.idempotency import BoundKey
from worker.jobs.identifiers import ids_in_order, new_job_id
from worker.jobs.ledger import Ledger
from worker.jobs.queue import JobQueue

PAIRS = 250  # more than two steps' worth
ROOM = 1000


@pytest.fixture
def broker(own_broker: EmbeddedBroker) -> EmbeddedBroker:
    """One for each test: its batches alone are open."""
    return own_broker


def batch_of(pairs: int, **fields: object) -> BatchRecord:
    return BatchRecord(id=new_job_id(), created=datetime.now(UTC), pairs=pairs).model_copy(
        update=fields
    )


def staged(batches: Batches, batch: BatchRecord) -> list[str]:
    jobs = [
        make_job().model_copy(update={"id": job_id, "batch": batch.id, "owner": batch.owner})
        for job_id in islice(ids_in_order(), batch.pairs)
    ]
    for start in range(0, len(jobs), 100):
        batches.stage(batch.id, jobs[start : start + 100])
    return [job.id for job in jobs]


def accepted(
    batches: Batches, pairs: int = PAIRS, **fields: object
) -> tuple[BatchRecord, list[str]]:
    batch = batch_of(pairs, **fields)
    ids = staged(batches, batch)
    batches.commit(batch, capacity=ROOM)
    return batch, ids


def ended(ledger: Ledger, job_id: str, verdict: str = "pass") -> None:
    ledger.succeed(job_id, ledger.begin(job_id), {}, verdict=verdict)  # type: ignore[arg-type]


def known_jobs(ledger: Ledger, batch: BatchRecord) -> list[str]:
    page = ledger.index.page(200, wanted=JobFilter(batch=batch.id))
    ids = [job.id for job in page.jobs]
    while page.cursor is not None:
        page = ledger.index.page(200, cursor=page.cursor, wanted=JobFilter(batch=batch.id))
        ids += [job.id for job in page.jobs]
    return ids[::-1]


def test_all_jobs_of_a_batch_wait_in_the_order_in_which_they_were_sent(
    batches: Batches, ledger: Ledger, queue: JobQueue
) -> None:
    batch, ids = accepted(batches)

    carry_through(batch.id, batches, queue)

    assert known_jobs(ledger, batch) == ids == batches.job_ids(batch.id)
    assert queue.waiting() == set(ids)
    assert batches.counts(batch).states["queued"] == PAIRS


def test_what_is_not_committed_is_no_batch_and_goes_by_itself(
    batches: Batches, ledger: Ledger, redis: Redis
) -> None:
    batch = batch_of(3)
    staged(batches, batch)

    with pytest.raises(UnknownBatchError):
        batches.get(batch.id)
    assert batches.open() == []
    assert batches.carry_on(batch.id) == ([], False)
    assert ledger.index.count("queued") == 0
    assert 0 < redis.ttl(f"meshcone:batch:{batch.id}:entry") <= STAGED_SECONDS


def test_jobs_of_an_accepted_batch_take_room_before_they_are_entered(
    batches: Batches, ledger: Ledger
) -> None:
    accepted(batches, 3)

    assert ledger.index.has_room(4, "default", None)
    assert not ledger.index.has_room(3, "default", None)
    further = batch_of(2)
    staged(batches, further)
    with pytest.raises(QueueFullError):
        batches.commit(further, capacity=4)


def test_a_batch_that_is_being_entered_keeps_out_no_other_project(
    batches: Batches, ledger: Ledger
) -> None:
    accepted(batches, 3)

    assert ledger.index.has_room(3, "other", None)


def test_a_commit_that_comes_too_late_is_refused(batches: Batches, redis: Redis) -> None:
    batch = batch_of(3)
    staged(batches, batch)
    redis.delete(f"meshcone:batch:{batch.id}:entry")  # as when its time is over

    with pytest.raises(StagedJobsLostError):
        batches.commit(batch, capacity=ROOM)

    assert batches.open() == []


def test_a_batch_for_which_there_is_no_room_is_refused_whole(
    batches: Batches, ledger: Ledger
) -> None:
    batch = batch_of(3)
    staged(batches, batch)

    with pytest.raises(QueueFullError):
        batches.commit(batch, capacity=2)

    assert batches.open() == []
    assert ledger.index.count("queued") == 0


def test_the_same_key_makes_one_batch(batches: Batches) -> None:
    first, again, other = batch_of(2), batch_of(2), batch_of(2)
    for batch in (first, again, other):
        staged(batches, batch)
    key = BoundKey("meshcone:idempotency:test", "same", 60)

    assert batches.commit(first, capacity=ROOM, key=key) == first.id
    assert batches.commit(again, capacity=ROOM, key=key) == first.id
    with pytest.raises(KeyReusedError):
        batches.commit(other, capacity=ROOM, key=BoundKey(key.place, "other", 60))
    assert batches.open() == [first.id]


KILLED = """
import os, signal, sys
from worker.broker.connections import connect_text
from worker.jobs.batches import Batches

url, batch_id, steps = sys.argv[1:]
with connect_text(url) as client:
    for _ in range(int(steps)):
        Batches(client).carry_on(batch_id)
    os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.parametrize("steps", [0, 1, 2])
def test_a_batch_whose_entry_was_cut_short_by_a_kill_is_completed(
    batches: Batches, ledger: Ledger, queue: JobQueue, broker: EmbeddedBroker, steps: int
) -> None:
    batch, ids = accepted(batches)
    killed = subprocess.run([sys.executable, "-c", KILLED, broker.url, batch.id, str(steps)])
    assert killed.returncode == -signal.SIGKILL
    assert batches.counts(batch).states["queued"] == PAIRS  # whoever asks sees all of them
    assert ledger.index.count("queued") == min(100 * steps, PAIRS)

    for batch_id in batches.open():
        carry_through(batch_id, batches, queue)

    assert known_jobs(ledger, batch) == ids
    assert ledger.index.count("queued") == PAIRS


def test_upkeep_completes_it_by_itself(
    batches: Batches, ledger: Ledger, queue: JobQueue, broker: EmbeddedBroker, tmp_path: Path
) -> None:
    batch, ids = accepted(batches)
    batches.carry_on(batch.id)  # the process that did so has died
    environment = {
        **os.environ,
        "MESHCONE_REDIS_URL": broker.url,
        "MESHCONE_DATA_DIR": str(tmp_path),
        "MESHCONE_RECONCILE_INTERVAL": "0.1",
    }

    with subprocess.Popen([sys.executable, "-m", "worker.upkeep.main"], env=environment) as upkeep:
        deadline = time.monotonic() + 60
        while queue.waiting() != set(ids) and time.monotonic() < deadline:
            time.sleep(0.05)
        upkeep.kill()

    assert queue.waiting() == set(ids)
    assert known_jobs(ledger, batch) == ids


def test_a_batch_has_ended_when_the_last_of_its_jobs_has(batches: Batches, ledger: Ledger) -> None:
    batch, ids = accepted(batches, pairs=3)
    batches.carry_on(batch.id)
    for job_id, verdict in zip(ids, ("pass", "fail", "pass"), strict=True):
        assert batches.get(batch.id).finished is None
        ended(ledger, job_id, verdict)

    counts = batches.counts(batch)
    assert batches.get(batch.id).finished is not None
    assert batches.open() == []
    assert counts.states["succeeded"] == 3
    assert counts.verdicts == {"pass": 2, "fail": 1, "not_tested": 0}


def test_the_end_of_a_batch_is_told_once(batches: Batches, ledger: Ledger, redis: Redis) -> None:
    batch, ids = accepted(
        batches, pairs=2, webhook="https://ci.example.org/hook", labels=("nightly",)
    )
    batches.carry_on(batch.id)
    for job_id in ids:
        ended(ledger, job_id)

    [(_, entry)] = redis.xrange("meshcone:webhooks")
    assert entry["job"] == batch.id
    assert '"batch":true' in entry["message"]


def test_a_batch_that_is_canceled_while_it_is_entered_has_no_job_that_goes_on(
    batches: Batches, ledger: Ledger, queue: JobQueue
) -> None:
    batch, ids = accepted(batches)
    batches.carry_on(batch.id)
    running = ids[0]
    attempt = ledger.begin(running)

    assert batches.request_cancel(batch.id)
    carry_through(batch.id, batches, queue)
    assert ledger.get(running).cancel_requested
    assert batches.get(batch.id).finished is None  # one runs until its worker has noticed
    ledger.end_canceled(running, attempt)

    record = batches.get(batch.id)
    assert record.finished is not None
    assert batches.counts(record).states["canceled"] == PAIRS
    assert queue.waiting() == set()
    assert not batches.request_cancel(batch.id)  # it has ended


def test_a_batch_that_is_canceled_asks_each_of_its_running_jobs_to_stop_once(
    batches: Batches, ledger: Ledger, queue: JobQueue, redis: Redis
) -> None:
    batch, ids = accepted(batches, pairs=2)
    batches.carry_on(batch.id)
    for job_id in ids:
        ledger.begin(job_id)

    batches.request_cancel(batch.id)
    for _ in range(2):  # whoever canceled it, and upkeep
        carry_through(batch.id, batches, queue)

    for job_id in ids:
        assert ledger.get(job_id).cancel_requested
        events = [entry["event"] for _, entry in redis.xrange(f"meshcone:job:{job_id}:events")]
        assert events.count("cancel") == 1


@pytest.mark.parametrize("pairs", [1, 3])
def test_a_batch_that_is_canceled_before_any_job_is_entered_counts_all_as_canceled(
    batches: Batches, ledger: Ledger, queue: JobQueue, pairs: int
) -> None:
    batch, _ = accepted(batches, pairs)

    batches.request_cancel(batch.id)
    carry_through(batch.id, batches, queue)

    record = batches.get(batch.id)
    assert record.finished is not None
    assert batches.counts(record).states["canceled"] == pairs
    assert known_jobs(ledger, batch) == []


def test_a_batch_goes_with_the_last_of_its_jobs(
    batches: Batches, ledger: Ledger, redis: Redis
) -> None:
    batch, ids = accepted(batches, pairs=2)
    batches.carry_on(batch.id)
    for job_id in ids:
        ended(ledger, job_id)

    ledger.delete(ids[0])
    assert batches.get(batch.id).pairs == 2
    ledger.delete(ids[1])

    with pytest.raises(UnknownBatchError):
        batches.get(batch.id)
    assert batches.page(10, cursor=None, project=None).batches == ()
    assert redis.keys("meshcone:batch*") == []


def test_batches_are_listed_newest_first_and_by_project(batches: Batches) -> None:
    made = [accepted(batches, 1, project=name)[0].id for name in ("lamps", "chairs", "lamps")]

    first = batches.page(2, cursor=None, project=None)
    rest = batches.page(2, cursor=first.cursor, project=None)

    assert [batch.id for batch in first.batches + rest.batches] == made[::-1]
    assert rest.cursor is None
    assert [batch.id for batch in batches.page(9, cursor=None, project="lamps").batches] == [
        made[2],
        made[0],
    ]


def test_a_job_that_an_older_worker_has_moved_is_found_in_its_batch(
    batches: Batches, ledger: Ledger, redis: Redis
) -> None:
    batch, [job_id] = accepted(batches, pairs=1)
    batches.carry_on(batch.id)
    redis.hset(f"meshcone:job:{job_id}", "state", "canceled")
    redis.zrem("meshcone:since:queued", job_id)
    redis.zadd("meshcone:since:canceled", {job_id: 1.0})

    ledger.index.place_by_project(10)
    batches.carry_on(batch.id)

    assert batches.counts(batch).states["canceled"] == 1
    assert batches.get(batch.id).finished is not None


def test_ids_of_one_moment_sort_in_the_order_in_which_they_were_made() -> None:
    ids = list(islice(ids_in_order(), 20_000))

    assert ids == sorted(set(ids))
