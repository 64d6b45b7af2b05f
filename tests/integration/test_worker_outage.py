"""A worker whose broker is away, or refuses."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.integration.sending import sent, worker
from tests.integration.waiting import PATIENCE, wait_for
from worker.broker.connections import connect_bytes, connect_text
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.ledger import Ledger
from worker.jobs.queue import JobQueue
from worker.settings import WorkerSettings


@pytest.fixture
def broker(tmp_path: Path) -> Iterator[EmbeddedBroker]:
    with EmbeddedBroker(tmp_path) as started:
        yield started


@pytest.fixture
def settings(tmp_path: Path, broker: EmbeddedBroker) -> WorkerSettings:
    return WorkerSettings(data_dir=tmp_path, redis_url=broker.url)


def wait_until_listed(settings: WorkerSettings, pid: int) -> None:
    with connect_bytes(settings.required_redis_url()) as connection:
        queue = JobQueue(settings, connection)
        wait_for(lambda: queue.local_worker_pids() == {pid}, PATIENCE)


def kill(broker: EmbeddedBroker) -> None:
    assert broker.pid is not None
    os.kill(broker.pid, signal.SIGKILL)
    wait_for(broker.has_ended)


def test_a_worker_goes_on_when_its_broker_is_back(
    settings: WorkerSettings, broker: EmbeddedBroker
) -> None:
    with worker(settings, "worker", {}) as (process, log):
        wait_until_listed(settings, process.pid)
        kill(broker)
        wait_for(lambda: "could not connect" in log.read_text(), PATIENCE)

        broker.start()

        with connect_text(broker.url) as client:
            job, ledger = sent(settings, Ledger(client)), Ledger(client)
            wait_for(lambda: ledger.get(job.id).has_ended, PATIENCE)
            assert ledger.get(job.id).state == "succeeded"
        assert process.poll() is None


def test_a_worker_stops_though_its_broker_is_away(
    settings: WorkerSettings, broker: EmbeddedBroker
) -> None:
    with worker(settings, "worker", {}) as (process, log):
        wait_until_listed(settings, process.pid)
        kill(broker)
        wait_for(lambda: "could not connect" in log.read_text(), PATIENCE)

        process.terminate()

        assert process.wait(PATIENCE) == 0


def test_a_worker_waits_for_a_broker_that_refuses(
    settings: WorkerSettings, broker: EmbeddedBroker
) -> None:
    with worker(settings, "worker", {}) as (process, log), connect_text(broker.url) as client:
        wait_until_listed(settings, process.pid)
        client.config_set("maxmemory", 1)
        wait_for(lambda: "the broker cannot be used" in log.read_text(), PATIENCE)

        client.config_set("maxmemory", 0)

        job, ledger = sent(settings, Ledger(client)), Ledger(client)
        wait_for(lambda: ledger.get(job.id).has_ended, PATIENCE)
        assert ledger.get(job.id).state == "succeeded"
        assert process.poll() is None


def test_a_worker_that_starts_before_its_broker_waits_for_it(
    settings: WorkerSettings, broker: EmbeddedBroker
) -> None:
    broker.stop()
    with worker(settings, "worker", {}) as (process, log):
        wait_for(lambda: "the broker cannot be used" in log.read_text(), PATIENCE)

        broker.start()

        wait_until_listed(settings, process.pid)
