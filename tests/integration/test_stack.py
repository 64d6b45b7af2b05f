from __future__ import annotations

import os
import signal
from pathlib import Path

import httpx2
import pytest

from meshcone.errors import InputError
from meshcone.files import MeshFile
from service.client import Client
from service.stack import Stack
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

        stack.restart_ended()

        assert stack.pids()[name] != ended
        with Client(stack.url) as client:
            job = insist(lambda: client.submit(rough_ball, ball))
            wait_for(lambda: insist(lambda: client.job(job.id)).state == "succeeded")


def test_what_keeps_ending_is_started_again_and_the_rest_goes_on(tmp_path: Path) -> None:
    with Stack(WorkerSettings(data_dir=tmp_path), log=tmp_path / "log") as stack:
        api, broker = stack.pids()["API"], stack.pids()["broker"]
        for _ in range(4):
            kill_the_worker(stack)

        assert httpx2.get(f"{stack.url}/livez", trust_env=False).status_code == 200
        assert (stack.pids()["API"], stack.pids()["broker"]) == (api, broker)


def kill_the_worker(stack: Stack) -> None:
    """Kill it and wait until there is another."""
    [worker] = stack.worker_pids()
    os.kill(worker, signal.SIGKILL)

    def is_another() -> bool:
        stack.restart_ended()
        return stack.worker_pids() != [worker]

    wait_for(is_another)


def test_workers_hold_no_secret_for_other_hosts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    secret = "whsec_" + "c2VjcmV0" * 4
    monkeypatch.setenv("MESHCONE_WEBHOOK_SECRET", secret)
    with Stack(WorkerSettings(data_dir=tmp_path), log=tmp_path / "log") as stack:
        holders = {
            name
            for name, pid in stack.pids().items()
            if secret.encode() in Path(f"/proc/{pid}/environ").read_bytes()
        }

    assert "webhooks" in holders
    assert not [name for name in holders if name.startswith("worker")]
