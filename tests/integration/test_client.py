"""The client against a server that answers as it is told."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler
from typing import Any

import httpx2
import pytest

from meshcone.errors import InputError
from meshcone.files import MeshFile
from service.api.schemas import Job
from service.client import Client, ServiceError
from service.client.connection import connect
from service.problems import problem
from tests.integration.jobs import make_job
from tests.listening import Silent, listening

MESH = MeshFile("mug.obj", b"v 0 0 0\n", {"mug.mtl": b"newmtl mug\n"})


@dataclass
class Script:
    """Answers to give, one after the other, and the requests that came."""

    url: str = ""
    answers: list[tuple[int, dict[str, str], Any]] = field(default_factory=list)
    requests: list[tuple[str, dict[str, str], bytes]] = field(default_factory=list)

    def fails(self, name: str, **headers: str) -> None:
        """Answer next with a problem."""
        found = problem(name, "for the time being")
        sent = {"Content-Type": "application/problem+json", **headers}
        self.answers.append((found.status, sent, found.model_dump(exclude_none=True)))

    def succeeds(self, status: int = 200, body: Any = None) -> None:
        """Answer next with a document."""
        self.answers.append((status, {"Content-Type": "application/json"}, body))


@pytest.fixture
def script() -> Iterator[Script]:
    scripted = Script()

    class Handler(Silent, BaseHTTPRequestHandler):
        def answer(self) -> None:
            body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
            headers = {name.lower(): value for name, value in self.headers.items()}
            scripted.requests.append((f"{self.command} {self.path}", headers, body))
            if not scripted.answers:  # hang up, as a server that is stopped does
                self.close_connection = True
                return
            status, sent, document = scripted.answers.pop(0)
            content = b"" if document is None else json.dumps(document).encode()
            self.send_response(status)
            for name, value in {**sent, "Content-Length": str(len(content))}.items():
                self.send_header(name, value)
            self.end_headers()
            self.wfile.write(content)

        do_GET = do_POST = do_PUT = do_HEAD = do_DELETE = answer

    with listening(Handler) as address:
        scripted.url = f"http://{address}"
        yield scripted


@pytest.fixture
def client(script: Script) -> Iterator[Client]:
    with Client(script.url, patience=5) as connected:
        yield connected


def a_job() -> dict[str, Any]:
    return Job.of(make_job()).model_dump(mode="json")


@pytest.mark.parametrize("name", ["unavailable", "queue-full", "rate-limit", "key-in-use"])
def test_a_service_that_cannot_just_now_is_asked_again(
    script: Script, client: Client, name: str
) -> None:
    script.fails(name, **{"Retry-After": "0"})
    script.succeeds(202, a_job())

    client.submit(MESH, MESH)

    assert len(script.requests) == 2


def test_every_try_of_a_submission_has_the_same_key(script: Script, client: Client) -> None:
    for _ in range(2):
        script.fails("unavailable", **{"Retry-After": "0"})
    script.succeeds(202, a_job())

    client.submit(MESH, MESH)
    script.succeeds(202, a_job())
    client.submit(MESH, MESH)

    keys = [headers["idempotency-key"] for _, headers, _ in script.requests]
    assert len(set(keys[:3])) == 1
    assert keys[3] != keys[0]


def test_a_service_that_asks_for_too_much_patience_is_given_up(
    script: Script, client: Client
) -> None:
    script.fails("queue-full", **{"Retry-After": "3600"})

    with pytest.raises(ServiceError, match="for the time being") as refusal:
        client.jobs()

    assert refusal.value.problem.status == 503
    assert len(script.requests) == 1


@pytest.mark.parametrize("name", ["input", "unauthorized", "forbidden", "not-found", "key-reused"])
def test_what_would_only_be_said_again_is_not_asked_again(
    script: Script, client: Client, name: str
) -> None:
    script.fails(name)

    with pytest.raises(ServiceError):
        client.submit(MESH, MESH)

    assert len(script.requests) == 1


def test_a_service_that_was_there_is_waited_for(script: Script) -> None:
    script.succeeds(200, {"jobs": [], "next": None})
    with Client(script.url, patience=1) as client:
        client.jobs()
        with pytest.raises(httpx2.TransportError):
            client.jobs()

    assert len(script.requests) > 2


def test_a_service_that_never_was_is_not_waited_for() -> None:
    with (
        Client("http://127.0.0.1:9", patience=3600) as client,
        pytest.raises(httpx2.TransportError),
    ):
        client.jobs()


def test_a_key_is_sent_with_every_request(script: Script) -> None:
    script.succeeds(200, {"jobs": [], "next": None})
    with Client(script.url, api_key="mc_secret") as client:
        client.jobs()

    assert script.requests[0][1]["authorization"] == "Bearer mc_secret"


def test_a_file_the_service_has_is_not_sent(script: Script, client: Client) -> None:
    script.succeeds(200)
    script.succeeds(202, a_job())

    blob = client.upload(MESH)
    client.submit(blob, blob)

    assert [line for line, _, _ in script.requests] == [
        f"HEAD /v1/blobs/{blob.sha256}",
        "POST /v1/jobs",
    ]
    assert script.requests[1][1]["content-type"].startswith("multipart/form-data")
    assert blob.sha256.encode() in script.requests[1][2]
    assert MESH.data not in script.requests[1][2]


def test_a_file_the_service_has_not_is_sent(script: Script, client: Client) -> None:
    script.succeeds(404)
    script.succeeds(201, {})

    client.upload(MESH)

    assert script.requests[1][2] == MESH.data


def test_pages_are_turned(script: Script, client: Client) -> None:
    first, second = a_job(), a_job()
    script.succeeds(200, {"jobs": [first], "next": "here"})
    script.succeeds(200, {"jobs": [second], "next": None})

    found = list(client.all_jobs(state="queued", label=["a", "b"]))

    assert [job.id for job in found] == [first["id"], second["id"]]
    assert script.requests[1][0] == "GET /v1/jobs?state=queued&label=a&label=b&cursor=here"


def test_a_command_that_needs_a_key_says_how_to_give_it(
    script: Script, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("MESHCONE_API_KEY", raising=False)
    script.fails("unauthorized")

    with pytest.raises(InputError, match="set MESHCONE_API_KEY"):
        connect(script.url)


def test_a_command_takes_its_key_from_the_environment(
    script: Script, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("MESHCONE_API_KEY", "mc_secret")
    script.succeeds(200, {"jobs": [], "next": None})

    connect(script.url).close()

    assert script.requests[0][1]["authorization"] == "Bearer mc_secret"


def test_a_server_that_is_no_such_service_is_called_that(script: Script) -> None:
    script.succeeds(200, {"hello": "world"})

    with pytest.raises(InputError, match="no MeshCone service answers"):
        connect(script.url)


def test_the_jobs_of_a_label_are_deleted_page_by_page(script: Script) -> None:
    script.succeeds(body={"deleted": 200, "not_finished": 1, "next": "abc"})
    script.succeeds(body={"deleted": 3, "not_finished": 0, "next": None})

    with Client(script.url) as client:
        done = client.delete_all("nightly", "old")

    assert (done.deleted, done.not_finished) == (203, 1)
    assert [request[0] for request in script.requests] == [
        "DELETE /v1/jobs?label=nightly&label=old",
        "DELETE /v1/jobs?label=nightly&label=old&cursor=abc",
    ]


def test_a_deletion_without_a_label_is_not_sent(script: Script) -> None:
    with Client(script.url) as client, pytest.raises(ValueError, match="name a label"):
        client.delete_all()

    assert script.requests == []
