"""Real processes, started once for all integration tests."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import pytest
from redis import Redis

from tests.integration.file_server import FileServer, file_server
from tests.integration.jobs import make_job
from tests.integration.receiver import Receiver, receiving
from tests.integration.telling import Deliver, telling
from tests.integration.transferring import Transfer, transferring
from worker.broker.connections import connect_bytes, connect_text
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.batches import Batches
from worker.jobs.ledger import Ledger
from worker.jobs.queue import JobQueue
from worker.jobs.records import JobRecord
from worker.settings import WorkerSettings
from worker.storage.blobs import BlobStore
from worker.storage.register import BlobRegister


@pytest.fixture(scope="session")
def broker(tmp_path_factory: pytest.TempPathFactory) -> Iterator[EmbeddedBroker]:
    with EmbeddedBroker(tmp_path_factory.mktemp("data")) as started:
        yield started


@pytest.fixture
def own_broker(tmp_path: Path) -> Iterator[EmbeddedBroker]:
    """A broker of one test alone. A module whose ``broker`` it is has all below in it."""
    with EmbeddedBroker(tmp_path / "broker") as started:
        yield started


@pytest.fixture
def redis(broker: EmbeddedBroker) -> Iterator[Redis]:
    with connect_text(broker.url) as client:
        yield client


@pytest.fixture
def ledger(redis: Redis) -> Ledger:
    return Ledger(redis)


@pytest.fixture
def batches(redis: Redis) -> Batches:
    return Batches(redis)


@pytest.fixture
def settings(broker: EmbeddedBroker, tmp_path: Path) -> WorkerSettings:
    return WorkerSettings(data_dir=tmp_path, redis_url=broker.url)


@pytest.fixture
def queue(settings: WorkerSettings) -> Iterator[JobQueue]:
    with connect_bytes(settings.required_redis_url()) as connection:
        yield JobQueue(settings, connection)


@pytest.fixture
def blobs(settings: WorkerSettings, redis: Redis) -> BlobStore:
    return BlobStore.open(settings, BlobRegister(redis))


@pytest.fixture
def server() -> Iterator[FileServer]:
    """A server of files on this machine."""
    with file_server() as started:
        yield started


@pytest.fixture
def transfer(settings: WorkerSettings) -> Transfer:
    """Runs the process that moves files while a block is worked through."""
    return partial(transferring, settings)


@pytest.fixture
def receiver() -> Iterator[Receiver]:
    """A server that receives webhooks."""
    with receiving() as started:
        yield started


@pytest.fixture
def deliver(broker: EmbeddedBroker, tmp_path: Path) -> Deliver:
    """Runs the process that delivers webhooks while a block is worked through."""
    return partial(telling, broker, tmp_path)


@pytest.fixture
def queued_job() -> JobRecord:
    return make_job()
