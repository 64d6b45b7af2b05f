"""A real worker process, and what happens to a job when things around it die."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from meshcone.files import MeshFile
from service.client import Client
from service.stack import Stack
from tests.holding import Hold
from tests.integration.jobs import make_job, stored_job
from tests.integration.waiting import PATIENCE, wait_for
from tests.processes import has_ended, horses_of
from worker.broker.connections import connect_bytes, connect_text
from worker.jobs.ledger import Ledger
from worker.jobs.queue import JobQueue
from worker.jobs.records import JobRecord
from worker.settings import WorkerSettings
from worker.storage.blobs import BlobStore
from worker.storage.register import BlobRegister


@pytest.fixture
def service_ledger(stack: Stack) -> Iterator[Ledger]:
    with connect_text(stack.redis_url) as connection:
        yield Ledger(connection)


def test_a_job_whose_horse_is_killed_is_started_again_and_succeeds(
    stack: Stack,
    client: Client,
    service_ledger: Ledger,
    hold: Hold,
    rough_ball: MeshFile,
    ball: MeshFile,
) -> None:
    job = client.submit(hold.mesh(rough_ball), ball)

    kill_horse(stack, service_ledger, job.id, attempt=1)
    hold.release()

    finished = client.wait(job.id, timeout=PATIENCE)
    assert (finished.state, finished.attempt) == ("succeeded", 2)


def test_a_job_that_kills_every_horse_fails_as_a_crash(
    stack: Stack,
    client: Client,
    service_ledger: Ledger,
    hold: Hold,
    rough_ball: MeshFile,
    ball: MeshFile,
) -> None:
    job = client.submit(hold.mesh(rough_ball), ball)

    for attempt in (1, 2, 3):
        kill_horse(stack, service_ledger, job.id, attempt)

    failed = client.wait(job.id, timeout=PATIENCE)
    assert failed.state == "failed"
    assert failed.error is not None
    assert failed.error.kind == "crash"
    assert "SIGKILL" in failed.error.detail


def test_a_file_that_only_the_worker_reads_fails_with_the_readers_message(
    stack: Stack, client: Client, service_ledger: Ledger, data_dir: Path
) -> None:
    settings = WorkerSettings(data_dir=data_dir)
    with connect_text(stack.redis_url) as connected:
        blobs = BlobStore.open(settings, BlobRegister(connected))
        record = stored_job(blobs, MeshFile("empty.obj", b""))
    service_ledger.create(record)
    with connect_bytes(stack.redis_url) as connection:
        JobQueue(settings, connection).enqueue(record.id)

    failed = client.wait(record.id, timeout=PATIENCE)

    assert failed.error is not None
    assert (failed.error.kind, failed.error.file) == ("input", "empty.obj")
    assert "empty" in failed.error.detail


def test_a_missing_blob_is_a_fault_of_the_service_and_shows_no_path(
    stack: Stack, client: Client, service_ledger: Ledger, data_dir: Path
) -> None:
    record = make_job()  # whose files nobody stored
    service_ledger.create(record)
    with connect_bytes(stack.redis_url) as connection:
        JobQueue(WorkerSettings(data_dir=data_dir), connection).enqueue(record.id)

    failed = client.wait(record.id, timeout=PATIENCE)

    assert failed.error is not None
    assert (failed.attempt, failed.error.kind) == (1, "internal")
    assert str(data_dir) not in failed.error.detail


def test_horse_ends_with_its_worker(
    tmp_path: Path, hold: Hold, rough_ball: MeshFile, ball: MeshFile
) -> None:
    with hold.stack(WorkerSettings(data_dir=tmp_path), log=tmp_path / "log") as doomed:
        with Client(doomed.url) as client:
            client.submit(hold.mesh(rough_ball), ball)
        [worker] = doomed.worker_pids()
        wait_for(lambda: bool(horses_of(worker)))
        [horse] = horses_of(worker)

        os.kill(worker, signal.SIGKILL)

        wait_for(lambda: has_ended(horse))


def kill_horse(stack: Stack, ledger: Ledger, job_id: str, attempt: int) -> None:
    def is_running() -> bool:
        record: JobRecord = ledger.get(job_id)
        return (record.state, record.attempt) == ("running", attempt)

    [worker] = stack.worker_pids()
    wait_for(lambda: is_running() and bool(horses_of(worker)))
    for horse in horses_of(worker):
        os.kill(horse, signal.SIGKILL)
