from __future__ import annotations

import os
import signal
from collections.abc import Iterator
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

SECRET = "whsec_" + "c2VjcmV0" * 4


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


@pytest.fixture(scope="module")
def doomed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Stack]:
    """One whose processes are killed, and that has a secret to send with webhooks."""
    directory = tmp_path_factory.mktemp("doomed")
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("MESHCONE_WEBHOOK_SECRET", SECRET)
        stack = Stack(WorkerSettings(data_dir=directory), log=directory / "log")
        stack.start()  # its processes have the secret, and nothing else that starts meanwhile
    try:
        yield stack
    finally:
        stack.stop()


def test_workers_hold_no_secret_for_other_hosts(doomed: Stack) -> None:
    holders = {
        name
        for name, pid in doomed.pids().items()
        if SECRET.encode() in Path(f"/proc/{pid}/environ").read_bytes()
    }

    assert "webhooks" in holders
    assert not [name for name in holders if name.startswith("worker")]


@pytest.mark.parametrize("name", ["worker 1", "API", "broker"])
def test_what_ends_unasked_is_started_again(
    doomed: Stack, name: str, rough_ball: MeshFile, ball: MeshFile
) -> None:
    ended = doomed.pids()[name]
    os.kill(ended, signal.SIGKILL)
    wait_for(lambda: has_ended(ended))

    doomed.restart_ended()

    assert doomed.pids()[name] != ended
    with Client(doomed.url) as client:
        job = insist(lambda: client.submit(rough_ball, ball))
        wait_for(lambda: insist(lambda: client.job(job.id)).state == "succeeded")


def test_what_keeps_ending_is_started_again_and_the_rest_goes_on(tmp_path: Path) -> None:
    with Stack(WorkerSettings(data_dir=tmp_path), log=tmp_path / "log") as stack:
        api, broker = stack.pids()["API"], stack.pids()["broker"]
        for _ in range(4):
            kill_the_worker(stack)

        assert httpx2.get(f"{stack.url}/livez", trust_env=False, timeout=60).status_code == 200
        assert (stack.pids()["API"], stack.pids()["broker"]) == (api, broker)


def kill_the_worker(stack: Stack) -> None:
    """Kill it and wait until there is another."""
    [worker] = stack.worker_pids()
    os.kill(worker, signal.SIGKILL)

    def is_another() -> bool:
        stack.restart_ended()
        return stack.worker_pids() != [worker]

    wait_for(is_another)
