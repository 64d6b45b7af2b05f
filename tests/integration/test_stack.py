from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

from meshcone.errors import InputError, InternalError
from meshcone.files import MeshFile
from service.client import Client
from service.stack import Stack
from service.stack.children import STARTS_ALLOWED
from tests.integration.waiting import insist, wait_for
from tests.processes import has_ended
from worker.broker.embedded import EmbeddedBroker
from worker.settings import WorkerSettings


def test_a_given_broker_replaces_the_embedded_one(
    broker: EmbeddedBroker, tmp_path: Path, rough_ball: MeshFile, ball: MeshFile
) -> None:
    settings = WorkerSettings(redis_url=broker.url, data_dir=tmp_path)

    with Stack(settings, log=tmp_path / "log") as stack, Client(stack.url) as client:
        job = client.wait(client.submit(rough_ball, ball).id)

    assert job.state == "succeeded"
    assert not (tmp_path / "broker").exists()
    assert not broker.has_ended()


@pytest.mark.usefixtures("stack")
def test_a_stack_that_cannot_start_leaves_nothing_running(data_dir: Path) -> None:
    second = Stack(WorkerSettings(data_dir=data_dir))

    with pytest.raises(InputError, match="in use by another broker"):
        second.start()

    assert second.worker_pids() == []


@pytest.mark.parametrize("name", ["worker 1", "API", "broker"])
def test_what_ends_unasked_is_started_again(
    tmp_path: Path, name: str, rough_ball: MeshFile, ball: MeshFile
) -> None:
    with Stack(WorkerSettings(data_dir=tmp_path), log=tmp_path / "log") as stack:
        ended = stack.pids()[name]
        os.kill(ended, signal.SIGKILL)
        wait_for(lambda: has_ended(ended))

        stack.mend()

        assert stack.pids()[name] != ended
        with Client(stack.url) as client:
            job = insist(lambda: client.submit(rough_ball, ball))
            wait_for(lambda: insist(lambda: client.job(job.id)).state == "succeeded")


def test_what_keeps_ending_is_not_started_for_ever(tmp_path: Path) -> None:
    with Stack(WorkerSettings(data_dir=tmp_path), log=tmp_path / "log") as stack:
        for _ in range(STARTS_ALLOWED - 1):
            kill_the_worker(stack)
            stack.mend()
        kill_the_worker(stack)

        with pytest.raises(InternalError, match="worker 1 keeps ending"):
            stack.mend()


def kill_the_worker(stack: Stack) -> None:
    [worker] = stack.worker_pids()
    os.kill(worker, signal.SIGKILL)
    wait_for(lambda: has_ended(worker))
