"""What a client makes of answers that are no MeshCone service's, and of what cannot be sent."""

from __future__ import annotations

import copy
import os
import pickle
from collections.abc import Callable

import httpx2
import pytest

from meshcone.errors import InputError
from meshcone.files import MeshFile
from service.client import Client, ServiceError, connection
from service.client.connection import connect
from service.problems import MEDIA_TYPE, Problem

Answer = tuple[int, str, bytes]

FORBIDDEN = Problem(
    type="urn:meshcone:problem:forbidden",
    title="Not permitted",
    status=403,
    detail="the API key may not read",
    kind="input",
    file="mug.glb",
)
PAGE: Answer = (200, "text/html; charset=utf-8", b"<html>Sign in</html>")
CALLS: dict[str, Callable[[Client], object]] = {
    "job": lambda client: client.job("1"),
    "jobs": lambda client: client.jobs(),
    "report": lambda client: client.report("1"),
    "report bytes": lambda client: client.report_bytes("1"),
    "diagnostics": lambda client: client.diagnostics("1"),
    "batch result": lambda client: client.batch_result("1"),
}


def client_of(*answers: Answer) -> Client:
    """A client of a service that gives these answers, and the last again and again."""
    waiting = list(answers)

    def answer(_: httpx2.Request) -> httpx2.Response:
        status, kind, content = waiting.pop(0) if len(waiting) > 1 else waiting[0]
        return httpx2.Response(status, headers={"content-type": kind}, content=content)

    client = Client("http://meshes.example.org", patience=0)
    client._transport._http = httpx2.Client(
        transport=httpx2.MockTransport(answer), base_url="http://meshes.example.org"
    )
    return client


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
@pytest.mark.parametrize("content", [b'"jobs"', b"{", b"[]", b"\xff"])
def test_an_answer_that_cannot_be_read_is_an_error_of_http(
    call: Callable[[Client], object], content: bytes
) -> None:
    with pytest.raises(httpx2.HTTPError, match="is not an answer of a MeshCone service"):
        call(client_of((200, "application/json", content)))


def test_the_page_of_a_proxy_is_not_taken_for_a_mesh() -> None:
    with pytest.raises(httpx2.HTTPError, match="GET /v1/jobs/1/mesh with status 200"):
        client_of(PAGE).mesh("1")


def test_a_problem_of_somebody_else_is_told_by_its_status() -> None:
    with pytest.raises(httpx2.HTTPStatusError, match="500"):
        client_of((500, MEDIA_TYPE, b'{"x": 1}')).jobs()


def test_a_key_that_may_submit_alone_is_let_in(monkeypatch: pytest.MonkeyPatch) -> None:
    refusing = client_of((403, MEDIA_TYPE, FORBIDDEN.model_dump_json().encode()))
    monkeypatch.setattr(connection, "Client", lambda *_, **__: refusing)

    assert connect("http://meshes.example.org") is refusing


@pytest.mark.parametrize("key", ["schlüssel", "key\r", "a key", "\udcff"])
def test_a_key_that_no_request_can_carry_is_refused_and_not_shown(
    monkeypatch: pytest.MonkeyPatch, key: str
) -> None:
    monkeypatch.setitem(os.environ, "MESHCONE_API_KEY", key)

    with pytest.raises(InputError, match=r"MESHCONE_API_KEY: .*no request can carry") as told:
        connect("http://127.0.0.1:9")
    with pytest.raises(InputError, match="the API key has characters in it"):
        Client("http://127.0.0.1:9", api_key=key)
    assert key not in str(told.value)


def test_half_a_character_is_refused_before_it_is_sent() -> None:
    client = client_of(PAGE)

    with pytest.raises(InputError, match=r"has '.udcff' in it, which no request can carry"):
        client.submit(("mug.obj", b"v 0 0 0"), labels=["\udcff"])
    with pytest.raises(InputError, match=r"has '.ud800' in it"):
        client.submit_batch([{"name": "\ud800"}])


def test_a_file_whose_name_is_no_text_is_sent_under_its_escape() -> None:
    created = (201, "application/json", b"{}")

    blob = client_of(created).upload(MeshFile("\udcff.obj", b""))

    assert blob.name == "\\udcff.obj"


def test_a_problem_goes_from_process_to_process() -> None:
    error = ServiceError(FORBIDDEN)

    for same in (pickle.loads(pickle.dumps(error)), copy.copy(error)):  # noqa: S301 - our own
        assert (str(same), same.problem) == ("mug.glb: the API key may not read", FORBIDDEN)


def test_an_answer_that_cannot_be_read_goes_from_process_to_process() -> None:
    with pytest.raises(httpx2.HTTPError) as caught:
        client_of(PAGE).jobs()

    same = pickle.loads(pickle.dumps(caught.value))  # noqa: S301 - our own
    assert (type(same), str(same)) == (type(caught.value), str(caught.value))
