from __future__ import annotations

from collections.abc import Iterator

import pytest
from fastapi import FastAPI
from httpx2 import Response
from starlette.testclient import TestClient

from meshcone.errors import (
    InfeasibleError,
    InputError,
    LimitError,
    MeshConeError,
    SolveTimeoutError,
)
from service.problems import PROBLEM_TYPES, problem_of
from tests.unit.service.conftest import LOCAL
from worker.jobs.identifiers import new_job_id

BOUNDARY = {"Content-Type": "multipart/form-data; boundary=x"}


def assert_problem(answer: Response, status: int, name: str) -> None:
    assert answer.status_code == status
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.headers["x-content-type-options"] == "nosniff"
    body = answer.json()
    assert body["type"] == f"urn:meshcone:problem:{name}"
    assert body["status"] == status
    assert body["title"] == PROBLEM_TYPES[name].title
    assert "\n" not in body["detail"]


def test_an_unknown_path_is_a_problem(http: TestClient) -> None:
    assert_problem(http.get("/nowhere"), 404, "not-found")


def test_a_method_that_is_not_possible_is_a_problem_with_those_that_are(http: TestClient) -> None:
    answer = http.put("/v1/jobs")

    assert_problem(answer, 405, "method-not-allowed")
    assert answer.headers["allow"] == "DELETE, GET, HEAD, POST"


def test_a_parameter_out_of_range_is_a_problem(http: TestClient) -> None:
    answer = http.get("/v1/jobs", params={"limit": 0})

    assert_problem(answer, 422, "input")
    assert answer.json()["detail"].startswith("query parameter 'limit': ")


def test_a_parameter_that_is_no_word_of_a_list_is_named_without_our_types(http: TestClient) -> None:
    answer = http.get("/v1/jobs", params={"state": "done"})

    assert answer.json()["detail"].startswith("query parameter 'state': input should be 'queued', ")


def test_a_body_that_is_no_form_is_a_problem(http: TestClient) -> None:
    text = {"Content-Type": "text/plain"}

    assert_problem(http.post("/v1/jobs", content=b"{}", headers=text), 415, "media-type")


def test_a_broken_form_is_a_problem(http: TestClient) -> None:
    assert_problem(http.post("/v1/jobs", content=b"nonsense", headers=BOUNDARY), 400, "bad-request")


def test_a_declared_size_beyond_the_limit_is_a_problem(http: TestClient) -> None:
    assert_problem(http.post("/v1/jobs", content=bytes(100_001), headers=BOUNDARY), 413, "limit")


def test_an_undeclared_size_beyond_the_limit_is_a_problem(http: TestClient) -> None:
    def chunks() -> Iterator[bytes]:
        yield b'--x\r\nContent-Disposition: form-data; name="source"; filename="a.obj"\r\n\r\n'
        for _ in range(11):
            yield b"#" * 10_000

    assert_problem(http.post("/v1/jobs", content=chunks(), headers=BOUNDARY), 413, "limit")


def test_a_job_without_a_possible_name_is_not_found(http: TestClient) -> None:
    assert_problem(http.get("/v1/jobs/..%2Fetc"), 404, "not-found")
    assert_problem(http.get("/v1/jobs/abc/mesh"), 404, "not-found")


def test_a_broker_that_is_not_there_is_a_problem_of_the_service(http: TestClient) -> None:
    answer = http.get(f"/v1/jobs/{new_job_id()}")

    assert_problem(answer, 503, "unavailable")
    assert answer.headers["retry-after"]
    assert "nobody.sock" not in answer.text


def test_an_unexpected_error_is_a_problem_without_its_details(app: FastAPI) -> None:
    @app.get("/broken")
    def broken() -> None:
        raise RuntimeError("/srv/secret")

    with TestClient(app, LOCAL, raise_server_exceptions=False) as http:
        answer = http.get("/broken")

    assert_problem(answer, 500, "internal")
    assert "secret" not in answer.text


def test_the_front_end_is_alive_without_a_broker_but_not_ready(http: TestClient) -> None:
    assert http.get("/livez").json() == {"status": "ok"}
    assert_problem(http.get("/readyz"), 503, "unavailable")


@pytest.mark.parametrize(
    ("error", "status"),
    [
        (InputError("no faces", file="mug.obj", place="line 3"), 422),
        (LimitError("too large"), 413),
        (InfeasibleError("the pins contradict the caps"), 422),
        (SolveTimeoutError("out of time"), 504),
        (MeshConeError("ours"), 500),
    ],
)
def test_every_error_of_the_engine_has_a_problem(error: MeshConeError, status: int) -> None:
    answer = problem_of(error)

    assert (answer.status, answer.kind, answer.detail) == (status, error.kind, error.message)
    assert (answer.file, answer.place) == (error.file, error.place)
