"""A job whose options are newer than the workers there are."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import pytest
from redis import Redis

from meshcone.files import MeshFile
from meshcone.options import OPTIONS_VERSION
from service.api.schemas import Job
from tests import older, shapes
from tests.integration.jobs import stored_job
from tests.integration.waiting import wait_for
from worker.broker.connections import connect_bytes, connect_text
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.ledger import Ledger
from worker.jobs.queue import JobQueue
from worker.jobs.records import JobRecord
from worker.settings import WorkerSettings
from worker.storage.blobs import BlobStore
from worker.storage.register import BlobRegister

SMALL = {"effort": "fast", "quality": {"samples": 256, "emd_samples": 64}}
PATIENCE = 60.0  # seconds
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

    with worker(settings, "older", OLDER) as log:
        wait_for(lambda: ledger.get(job.id).needs_newer_worker is not None, PATIENCE)
        waiting = ledger.get(job.id)
        assert (waiting.state, waiting.attempt, waiting.handed_back) == ("queued", 0, 0)
        assert Job.of(waiting).needs_newer_worker is not None
        assert "options newer than this worker" in log.read_text()

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

    with worker(settings, "older", OLDER) as log:
        wait_for(lambda: ledger.get(known.id).has_ended, PATIENCE)
        assert ledger.get(known.id).state == "succeeded"
        assert log.read_text().count("options newer than this worker") == 1

    assert ledger.get(newer.id).state == "queued"


def sent(settings: WorkerSettings, ledger: Ledger, version: int) -> JobRecord:
    """A queued job that a program with some version of the options took in."""
    vertices, faces = shapes.sphere(1)
    with connect_text(settings.required_redis_url()) as connected:
        record = stored_job(
            BlobStore.open(settings, BlobRegister(connected)),
            MeshFile("rough.obj", shapes.obj(shapes.noisy(vertices), faces)),
            MeshFile("ball.obj", shapes.obj(vertices, faces)),
            options=SMALL,
            options_version=version,
        )
    ledger.create(record)
    with connect_bytes(settings.required_redis_url()) as connection:
        JobQueue(settings, connection).enqueue(record.id)
    return record


@contextmanager
def worker(settings: WorkerSettings, name: str, environment: Mapping[str, str]) -> Iterator[Path]:
    """A worker process, until the block's end; its log."""
    log = settings.data_dir / f"{name}.log"
    with log.open("wb") as file:
        process = subprocess.Popen(
            [sys.executable, "-m", "worker.main"],
            env={
                **os.environ,
                "MESHCONE_DATA_DIR": str(settings.data_dir),
                "MESHCONE_REDIS_URL": settings.required_redis_url(),
                "MESHCONE_RECONCILE_INTERVAL": str(settings.reconcile_interval),
                **environment,
            },
            stdout=file,
            stderr=file,
        )
        try:
            yield log
        finally:
            process.terminate()
            process.wait(60)
