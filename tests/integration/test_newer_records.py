"""A newer version has written to jobs that this one looks at."""

from __future__ import annotations

import logging

import pytest
from redis import Redis

from tests.integration.jobs import make_job
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.heartbeats import Heartbeats
from worker.jobs.ledger import Ledger
from worker.jobs.ledger_keys import job_keys
from worker.jobs.queue import JobQueue
from worker.jobs.records import JobRecord
from worker.upkeep.reconciler import Reconciler

NEWER = '{"stage": "texture", "round": 0, "rounds": 1, "fraction": 0.1}'


@pytest.fixture
def broker(own_broker: EmbeddedBroker) -> EmbeddedBroker:
    return own_broker


@pytest.fixture
def newer_job(redis: Redis, ledger: Ledger) -> JobRecord:
    """A healthy job, whose worker is at a stage that this version does not know."""
    job = make_job()
    ledger.create(job)
    Heartbeats(redis, 60).beat(job.id, ledger.begin(job.id))
    redis.hset(job_keys(job.id)[0], "progress", NEWER)
    return job


def test_the_dead_are_given_up_beside_it(
    redis: Redis, ledger: Ledger, queue: JobQueue, newer_job: JobRecord
) -> None:
    dead = make_job()
    ledger.create(dead)
    ledger.begin(dead.id)
    reconciler = Reconciler(ledger, queue, Heartbeats(redis, 10), attempts=3)

    for _ in range(2):
        reconciler.reconcile()

    assert ledger.get(dead.id).state == "queued"
    assert redis.hget(job_keys(newer_job.id)[0], "state") == "running"


def test_it_is_listed_without_what_cannot_be_read(ledger: Ledger, newer_job: JobRecord) -> None:
    [listed] = ledger.index.page(10).jobs

    assert (listed.id, listed.state, listed.progress) == (newer_job.id, "running", None)


def test_it_is_left_out_and_logged_where_its_verdict_cannot_be_read(
    redis: Redis, ledger: Ledger, newer_job: JobRecord, caplog: pytest.LogCaptureFixture
) -> None:
    other = make_job()
    ledger.create(other)
    redis.hset(job_keys(newer_job.id)[0], "verdict", '"perhaps"')

    with caplog.at_level(logging.WARNING):
        listed = ledger.index.page(10).jobs

    assert [each.id for each in listed] == [other.id]
    assert f"job {newer_job.id} is not listed" in caplog.text
    assert "verdict" in caplog.text
