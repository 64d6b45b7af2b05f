"""One fault each, with the settings an installation has by default, and what follows."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator

import pytest
from redis import Redis

from meshcone.files import MeshFile
from service.client import Client
from service.stack import Stack
from tests import shapes
from tests.holding import Hold
from tests.integration.jobs import stored_job
from tests.integration.outcomes import times_succeeded
from tests.integration.restarted import restarted_stack
from tests.integration.waiting import PATIENCE, insist, wait_for
from tests.processes import has_ended, horses_of, upkeep_of
from worker.broker.connections import connect_bytes, connect_text
from worker.jobs.ledger import Ledger
from worker.jobs.queue import JobQueue
from worker.jobs.records import JobRecord
from worker.settings import WorkerSettings
from worker.storage.blobs import BlobStore
from worker.storage.register import BlobRegister

Pair = tuple[MeshFile, MeshFile]
SMALL = {"effort": "fast", "quality": {"samples": 256, "emd_samples": 64}}


@pytest.fixture(scope="module")
def settings(tmp_path_factory: pytest.TempPathFactory) -> WorkerSettings:
    return WorkerSettings(data_dir=tmp_path_factory.mktemp("faults"))


@pytest.fixture(scope="module")
def faults_hold(tmp_path_factory: pytest.TempPathFactory) -> Hold:
    return Hold(tmp_path_factory.mktemp("held"))


@pytest.fixture(scope="module")
def restarted(settings: WorkerSettings, faults_hold: Hold) -> Iterator[Stack]:
    log = settings.data_dir / "log"
    with restarted_stack(settings, faults_hold, workers=2, log=log) as stack:
        yield stack


@pytest.fixture
def hold(faults_hold: Hold) -> Iterator[Hold]:
    yield faults_hold
    faults_hold.release()


@pytest.fixture
def caller(restarted: Stack) -> Iterator[Client]:
    with Client(restarted.url) as client:
        yield client


@pytest.fixture
def connection(restarted: Stack) -> Iterator[Redis]:
    with connect_text(restarted.redis_url) as opened:
        yield opened


@pytest.fixture
def jobs(connection: Redis) -> Ledger:
    return Ledger(connection)


@pytest.fixture
def queue(restarted: Stack, settings: WorkerSettings) -> Iterator[JobQueue]:
    with connect_bytes(restarted.redis_url) as connection:
        yield JobQueue(settings, connection)


@pytest.fixture(scope="module")
def small_pair() -> Pair:
    vertices, faces = shapes.sphere(1)
    rough = MeshFile("rough.obj", shapes.obj(shapes.noisy(vertices), faces))
    return rough, MeshFile("ball.obj", shapes.obj(vertices, faces))


@pytest.fixture
def unsent_job(
    jobs: Ledger, connection: Redis, settings: WorkerSettings, small_pair: Pair
) -> JobRecord:
    """A job the ledger knows and no message is about."""
    blobs = BlobStore.open(settings, BlobRegister(connection))
    record = stored_job(blobs, *small_pair, options=SMALL)
    jobs.create(record)
    return record


def test_a_job_whose_worker_and_horse_are_killed_is_done_by_another(
    restarted: Stack, caller: Client, jobs: Ledger, hold: Hold, small_pair: Pair
) -> None:
    source, reference = small_pair
    job = caller.submit(hold.mesh(source), reference, SMALL)
    worker = worker_of(restarted, jobs, job.id)
    [horse] = horses_of(worker)

    os.kill(worker, signal.SIGKILL)
    os.kill(horse, signal.SIGKILL)

    wait_for(lambda: jobs.get(job.id).attempt == 2)
    hold.release()
    assert caller.wait(job.id, timeout=PATIENCE).state == "succeeded"


def test_a_frozen_worker_loses_its_job_and_cannot_end_it_twice(
    restarted: Stack, caller: Client, jobs: Ledger, hold: Hold, small_pair: Pair
) -> None:
    source, reference = small_pair
    job = caller.submit(hold.mesh(source), reference, SMALL)
    worker = worker_of(restarted, jobs, job.id)
    [horse] = horses_of(worker)
    for pid in (worker, horse):
        os.kill(pid, signal.SIGSTOP)

    wait_for(lambda: jobs.get(job.id).attempt == 2)
    for pid in (worker, horse):
        os.kill(pid, signal.SIGCONT)

    wait_for(lambda: has_ended(horse))
    hold.release()
    finished = caller.wait(job.id, timeout=PATIENCE)
    assert (finished.state, finished.attempt) == ("succeeded", 2)


def test_a_job_the_api_died_before_sending_is_found(jobs: Ledger, unsent_job: JobRecord) -> None:
    wait_for(lambda: jobs.get(unsent_job.id).state == "succeeded")


def test_a_message_a_worker_died_holding_is_sent_again(
    jobs: Ledger, queue: JobQueue, unsent_job: JobRecord
) -> None:
    queue.rq.connection.rpush(queue.rq.intermediate_queue_key, f"{unsent_job.id}_0")

    wait_for(lambda: jobs.get(unsent_job.id).state == "succeeded")
    wait_for(lambda: not queue.taken())


def test_reconcilers_that_are_killed_are_replaced(
    restarted: Stack, jobs: Ledger, unsent_job: JobRecord
) -> None:
    for worker in restarted.worker_pids():
        for upkeep in upkeep_of(worker):
            os.kill(upkeep, signal.SIGKILL)

    wait_for(lambda: jobs.get(unsent_job.id).state == "succeeded")


def test_a_broker_that_is_killed_has_forgotten_nothing_it_acknowledged(
    restarted: Stack, caller: Client, connection: Redis, small_pair: Pair
) -> None:
    accepted = [caller.submit(*small_pair, SMALL).id for _ in range(10)]

    os.kill(restarted.pids()["broker"], signal.SIGKILL)

    for job_id in accepted:
        wait_for(lambda job_id=job_id: insist(lambda: caller.job(job_id)).state == "succeeded")
        assert insist(lambda job_id=job_id: times_succeeded(connection, job_id)) == 1


def test_an_api_that_is_killed_answers_again(
    restarted: Stack, caller: Client, small_pair: Pair
) -> None:
    job = caller.submit(*small_pair, SMALL)

    os.kill(restarted.pids()["API"], signal.SIGKILL)

    wait_for(lambda: insist(lambda: caller.job(job.id)).state == "succeeded")


def worker_of(stack: Stack, jobs: Ledger, job_id: str) -> int:
    """The worker whose horse runs a job, the only one, once it does."""

    def busy() -> list[int]:
        return [pid for pid in stack.worker_pids() if horses_of(pid)]

    wait_for(lambda: jobs.get(job_id).state == "running" and len(busy()) == 1)
    return busy()[0]
