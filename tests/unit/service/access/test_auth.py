"""Who may pass is decided before anything is read, and without a broker where it can be."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import anyio
import pytest
from starlette.testclient import TestClient
from starlette.types import Message, Receive, Scope, Send

from service.access.auth import Authentication, is_loopback, required_scope
from service.access.keys import parse_token
from service.api.app import create_app
from service.api.server import asks_for_keys
from service.settings import ServiceSettings

TOKEN = "mc_0123456789abcdef_" + "x" * 43


@pytest.fixture
def guarded(tmp_path: Path) -> Iterator[TestClient]:
    """An application that asks for keys."""
    settings = ServiceSettings(redis_url=f"unix://{tmp_path}/nobody.sock", data_dir=tmp_path)
    app = create_app(settings)
    with TestClient(app, "http://meshes.example.org", raise_server_exceptions=False) as client:
        yield client


@pytest.mark.parametrize(
    ("method", "path", "scope"),
    [
        ("GET", "/livez", None),
        ("GET", "/readyz", None),
        ("GET", "/openapi.json", None),
        ("GET", "/help/gates/", None),
        ("GET", "/metrics", "read"),
        ("POST", "/v1/jobs", "submit"),
        ("GET", "/v1/jobs", "read"),
        ("HEAD", "/v1/blobs/00", "submit"),
        ("PUT", "/v1/blobs/00", "submit"),
        ("POST", "/v1/jobs/1/cancel", "submit"),
        ("DELETE", "/v1/jobs", "delete"),
        ("DELETE", "/v1/jobs/1", "delete"),
        ("GET", "/a/route/nobody/has/thought/of", "read"),
        ("PATCH", "/a/route/nobody/has/thought/of", "submit"),
    ],
)
def test_every_request_but_a_probe_needs_a_scope(method: str, path: str, scope: str | None) -> None:
    assert required_scope(method, path) == scope


def test_an_application_asks_for_keys_unless_told_otherwise(guarded: TestClient) -> None:
    answer = guarded.get("/v1/jobs")

    assert answer.status_code == 401
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.headers["www-authenticate"] == 'Bearer realm="meshcone"'
    assert answer.json()["type"] == "urn:meshcone:problem:unauthorized"


def test_probes_need_no_key(guarded: TestClient) -> None:
    assert guarded.get("/livez").status_code == 200
    assert guarded.get("/readyz").status_code == 503  # there is no broker


def test_nothing_is_read_of_a_request_that_may_not_pass() -> None:
    sent: list[Message] = []

    async def app(_scope: Scope, _receive: Receive, _send: Send) -> None:
        raise AssertionError("it was let in")

    async def receive() -> Message:
        raise AssertionError("it was read")

    async def send(message: Message) -> None:
        sent.append(message)

    scope = {"type": "http", "method": "POST", "path": "/v1/jobs", "headers": []}
    anyio.run(Authentication(app, keys_required=True), scope, receive, send)

    assert sent[0]["status"] == 401
    assert (b"connection", b"close") in sent[0]["headers"]


@pytest.mark.parametrize("authorization", ["Bearer nonsense", "Basic dXNlcjpwYXNz", "Bearer", ""])
def test_what_is_no_key_is_told_so_without_asking_the_broker(
    guarded: TestClient, authorization: str
) -> None:
    answer = guarded.get("/v1/jobs", headers={"Authorization": authorization})

    assert answer.status_code == 401
    assert 'error="invalid_token"' in answer.headers["www-authenticate"]


def test_a_broker_that_is_away_is_not_taken_for_a_bad_key(guarded: TestClient) -> None:
    answer = guarded.get("/v1/jobs", headers={"Authorization": f"Bearer {TOKEN}"})

    assert answer.status_code == 503
    assert answer.headers["retry-after"]
    assert "nobody.sock" not in answer.text


@pytest.mark.parametrize(
    "headers",
    [
        {"Host": "rebound.example.org"},
        {"Host": "127.0.0.1.example.org"},
        {"Host": "["},
        {"Origin": "https://example.org"},
        {"Origin": "null"},
    ],
)
def test_without_keys_no_page_of_another_site_can_use_the_service(
    http: TestClient, headers: dict[str, str]
) -> None:
    answer = http.post("/v1/jobs", headers=headers)

    assert answer.status_code == 403
    assert answer.json()["type"] == "urn:meshcone:problem:forbidden"


@pytest.mark.parametrize("headers", [{"Host": "localhost:8000"}, {"Host": "[::1]:8000"}])
def test_without_keys_the_names_of_this_machine_are_answered_to(
    http: TestClient, headers: dict[str, str]
) -> None:
    assert http.post("/v1/jobs", headers=headers).status_code == 415  # it asks for a form


@pytest.mark.parametrize("host", ["127.0.0.1", "127.8.9.10", "::1", "[::1]", "localhost"])
def test_these_are_of_this_machine(host: str) -> None:
    assert is_loopback(host)


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "10.0.0.1", "example.org", ""])  # noqa: S104
def test_these_are_not(host: str) -> None:
    assert not is_loopback(host)


@pytest.mark.parametrize("token", ["", "mc_", TOKEN[:-1], TOKEN + "x", TOKEN.upper(), TOKEN + "\n"])
def test_a_token_is_spelled_in_one_way_only(token: str) -> None:
    assert parse_token(token) is None
    assert parse_token(TOKEN) == ("0123456789abcdef", "x" * 43)


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.1.7", "::"])  # noqa: S104
def test_a_server_that_others_reach_asks_for_keys(host: str) -> None:
    assert asks_for_keys(ServiceSettings(), host)


def test_a_server_that_only_its_machine_reaches_asks_where_it_is_told_to() -> None:
    assert not asks_for_keys(ServiceSettings(), "127.0.0.1")
    assert asks_for_keys(ServiceSettings(require_keys="always"), "127.0.0.1")
