"""A job that tells of its end."""

from __future__ import annotations

import base64
from collections.abc import Iterator
from pathlib import Path

import pytest
from standardwebhooks import Webhook

from meshcone.files import MeshFile
from service.client import Client
from service.stack import Stack
from tests.integration.receiver import Receiver, receiving
from worker.settings import WorkerSettings

SECRET = "whsec_" + base64.b64encode(bytes(range(32))).decode()


@pytest.fixture
def receiver() -> Iterator[Receiver]:
    with receiving() as started:
        yield started


@pytest.fixture
def telling(tmp_path: Path) -> Iterator[Stack]:
    """A service that may send webhooks to this machine."""
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("MESHCONE_WEBHOOK_SECRET", SECRET)
        environment.setenv("MESHCONE_WEBHOOK_PRIVATE_ADDRESSES", "true")
        with Stack(WorkerSettings(data_dir=tmp_path), log=tmp_path / "log") as running:
            yield running


def test_the_receiver_is_told_when_the_result_is_there(
    telling: Stack, receiver: Receiver, rough_ball: MeshFile, ball: MeshFile
) -> None:
    with Client(telling.url) as client:
        job = client.submit(rough_ball, ball, {"effort": "fast"}, webhook=receiver.url)
        receiver.wait_for(1)
        told = Webhook(SECRET).verify(receiver.received[0][1], receiver.received[0][0])

        assert told["data"]["id"] == job.id
        assert client.job(job.id).state == "succeeded"
        assert client.mesh(job.id)
