from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import pytest

from meshcone.errors import InputError, InternalError
from meshcone.files import MeshFile
from service.client import Client
from service.stack import Stack
from worker.broker import EmbeddedBroker
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


def test_a_worker_that_ends_unasked_is_noticed(tmp_path: Path) -> None:
    with Stack(WorkerSettings(data_dir=tmp_path), log=tmp_path / "log") as stack:
        [worker] = stack.worker_pids()
        os.kill(worker, signal.SIGKILL)

        with pytest.raises(InternalError, match="worker 1 ended unexpectedly"):
            check_for_a_while(stack)


def check_for_a_while(stack: Stack) -> None:
    deadline = time.monotonic() + 30
    while time.monotonic() < deadline:
        stack.check()
        time.sleep(0.01)
