"""Labels that a client is given as text."""

from __future__ import annotations

import json

import httpx2
import pytest

from meshcone.files import MeshFile
from service.client import Client

BALL = MeshFile("ball.glb", b"glTF")


@pytest.fixture
def sent() -> list[bytes]:
    """The bodies of the requests that were made."""
    return []


@pytest.fixture
def client(sent: list[bytes]) -> Client:
    """A client of a service that refuses whatever it is sent."""

    def answer(request: httpx2.Request) -> httpx2.Response:
        sent.append(request.read())
        return httpx2.Response(422)

    client = Client("http://meshes.example.org", patience=0)
    client._transport._http = httpx2.Client(
        transport=httpx2.MockTransport(answer), base_url="http://meshes.example.org"
    )
    return client


def test_text_is_one_label_of_a_job(client: Client, sent: list[bytes]) -> None:
    with pytest.raises(httpx2.HTTPStatusError):
        client.submit(BALL, labels="balls")

    assert sent[0].count(b'name="label"') == 1
    assert b"\r\n\r\nballs\r\n" in sent[0]


def test_text_is_one_label_of_a_batch_and_of_a_pair(client: Client, sent: list[bytes]) -> None:
    with pytest.raises(httpx2.HTTPStatusError):
        client.submit_batch([{"labels": "glass"}], {"labels": "nightly"})

    assert json.loads(sent[0]) == {"labels": ["nightly"], "pairs": [{"labels": ["glass"]}]}
