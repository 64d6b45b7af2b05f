"""A job whose options are newer than the workers there are."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from redis import Redis

from meshcone.options import OPTIONS_VERSION
from service.api.schemas import Job
from tests import older
from tests.integration.sending import sent, worker
from tests.integration.waiting import PATIENCE, wait_for
from worker.broker.connections import connect_text
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.ledger import Ledger
from worker.settings import WorkerSettings

OLDER = {"PYTHONPATH": os.pathsep.join([older.__path__[0], str(Path.cwd())])}


@pytest.fixture
def settings(tmp_path: Path) -> Iterator[WorkerSettings]:
    with EmbeddedBroker(tmp_path) as broker:
        yield WorkerSettings(data_dir=tmp_path, redis_url=broker.url, reconcile_interval=0.2)


@pytest.fixture
def redis(settings: WorkerSettings) -> Iterator[Redis]:
    with connect_text(settings.required_redis_url()) as client:
        yield client


def test_an_older_worker_leaves_a_job_to_a_newer_one_and_no_attempt_is_counted(
    settings: WorkerSettings, redis: Redis
) -> None:
    ledger = Ledger(redis)
    job = sent(settings, ledger, OPTIONS_VERSION)

    with worker(settings, "older", OLDER) as (_, log):
        wait_for(lambda: ledger.get(job.id).needs_newer_worker is not None, PATIENCE)
        waiting = ledger.get(job.id)
        assert (waiting.state, waiting.attempt, waiting.handed_back) == ("queued", 0, 0)
        assert Job.of(waiting).needs_newer_worker is not None
        wait_for(lambda: "options newer than this worker" in log.read_text())

        seen = log.read_text()
        assert seen.count("options newer than this worker") == 1  # however often it is offered
        with worker(settings, "newer", {}):
            wait_for(lambda: ledger.get(job.id).has_ended, PATIENCE)

    done = ledger.get(job.id)
    assert (done.state, done.attempt, done.needs_newer_worker) == ("succeeded", 1, None)


def test_an_older_worker_does_not_take_the_job_again_at_once(
    settings: WorkerSettings, redis: Redis
) -> None:
    # No message is sent again while the test looks.
    settings = settings.model_copy(update={"reconcile_interval": 3600.0})
    ledger = Ledger(redis)
    newer = sent(settings, ledger, OPTIONS_VERSION)
    known = sent(settings, ledger, 0)

    with worker(settings, "older", OLDER) as (_, log):
        wait_for(lambda: ledger.get(known.id).has_ended, PATIENCE)
        assert ledger.get(known.id).state == "succeeded"
        assert log.read_text().count("options newer than this worker") == 1

    assert ledger.get(newer.id).state == "queued"
