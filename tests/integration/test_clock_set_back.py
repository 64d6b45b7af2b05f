"""The broker's clock is set back by two hours: what runs out by it lasts as much longer."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest
from redis import Redis
from rq import Worker

from service.access.quotas import Pace, RateLimiter
from tests.integration.jobs import make_job
from worker.broker.connections import connect_async, connect_bytes
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.heartbeats import Heartbeats
from worker.jobs.idempotency import KeyClaims, KeyInUseError, key_place
from worker.jobs.identifiers import new_job_id
from worker.jobs.ledger import Ledger
from worker.jobs.ledger_keys import job_keys
from worker.jobs.queue import JobQueue
from worker.jobs.records import JobRecord
from worker.settings import WorkerSettings
from worker.upkeep.main import Turn
from worker.upkeep.reconciler import Reconciler

HOURS = 2 * 3600 * 1000  # milliseconds


def set_clock_back(redis: Redis, key: str) -> None:
    """What the step does to a key that runs out: it has two hours more left."""
    assert redis.pexpire(key, redis.pttl(key) + HOURS)


@pytest.fixture
def running_job(ledger: Ledger, queued_job: JobRecord) -> JobRecord:
    ledger.create(queued_job)
    ledger.begin(queued_job.id)
    return ledger.get(queued_job.id)


def test_a_heartbeat_from_the_future_counts_as_none(redis: Redis, running_job: JobRecord) -> None:
    heartbeats = Heartbeats(redis, 10)
    heartbeats.beat(running_job.id, running_job.attempt)
    assert heartbeats.missing([running_job]) == []

    set_clock_back(redis, f"{job_keys(running_job.id)[0]}:heartbeat")

    assert heartbeats.missing([running_job]) == [running_job]


def test_an_attempt_that_lives_is_known_again_by_its_next_heartbeat(
    redis: Redis, running_job: JobRecord
) -> None:
    heartbeats = Heartbeats(redis, 10)
    heartbeats.beat(running_job.id, running_job.attempt)
    set_clock_back(redis, f"{job_keys(running_job.id)[0]}:heartbeat")

    heartbeats.beat(running_job.id, running_job.attempt)

    assert heartbeats.missing([running_job]) == []


def test_a_claim_from_the_future_keeps_no_request_waiting(redis: Redis) -> None:
    claims, place = KeyClaims(redis), key_place("owner", new_job_id())
    claims.claim(place)
    with pytest.raises(KeyInUseError):
        claims.claim(place)

    set_clock_back(redis, place)

    assert claims.claim(place).job_id is None


def test_a_dead_reconcilers_turn_goes_to_another(redis: Redis) -> None:
    name = f"lock-{new_job_id()}"
    dead, heir = Turn(redis, name, 6), Turn(redis, name, 6)
    assert dead.is_ours()
    assert not heir.is_ours()

    set_clock_back(redis, name)

    assert heir.is_ours()


def test_a_dead_worker_is_not_counted(broker: EmbeddedBroker, redis: Redis, tmp_path: Path) -> None:
    settings = WorkerSettings(data_dir=tmp_path, queue=f"queue-{new_job_id()}")
    with connect_bytes(broker.url) as connection:
        queue = JobQueue(settings, connection)
        worker = Worker([queue.rq], connection=connection, serializer=queue.rq.serializer)
        worker.register_birth()
        assert queue.worker_count() == 1

        set_clock_back(redis, worker.key)

        assert (queue.worker_count(), queue.local_worker_pids()) == (0, set())


def test_a_heartbeat_of_a_worker_with_a_longer_timeout_counts(
    redis: Redis, running_job: JobRecord
) -> None:
    Heartbeats(redis, 60).beat(running_job.id, running_job.attempt)

    assert Heartbeats(redis, 5).missing([running_job]) == []


def test_a_dead_attempt_that_began_in_the_future_is_given_up(
    redis: Redis, ledger: Ledger, queue: JobQueue, running_job: JobRecord
) -> None:
    redis.zincrby("meshcone:since:running", HOURS / 1000, running_job.id)
    reconciler = Reconciler(ledger, queue, Heartbeats(redis, 10), attempts=3)

    for _ in range(2):
        reconciler.reconcile()

    assert ledger.get(running_job.id).state == "queued"


def test_a_job_queued_in_the_future_gets_the_message_it_lacks(
    redis: Redis, ledger: Ledger, queue: JobQueue
) -> None:
    job = make_job()
    ledger.create(job)
    redis.zincrby("meshcone:since:queued", HOURS / 1000, job.id)
    reconciler = Reconciler(ledger, queue, Heartbeats(redis, 10), attempts=3)

    for _ in range(2):
        reconciler.reconcile()

    assert job.id in queue.waiting()


def test_a_pace_from_the_future_keeps_no_request_out(redis: Redis, broker: EmbeddedBroker) -> None:
    key_id = new_job_id()
    redis.set(f"meshcone:pace:{key_id}", float(redis.time()[0]) + HOURS / 1000)

    async def take() -> Pace | None:
        async with connect_async(broker.url) as client:
            return await RateLimiter(client).take(key_id, 600)

    pace = asyncio.run(take())

    assert pace is not None
    assert pace.allowed
