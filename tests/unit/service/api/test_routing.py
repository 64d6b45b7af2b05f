"""What every call has in common: HEAD, and query parameters that it would ignore."""

from __future__ import annotations

import pytest
from starlette.testclient import TestClient

JOB = "/v1/jobs/01a229da-7009-79ac-bcb9-769550742bb1"


@pytest.mark.parametrize("path", ["/livez", "/readyz", "/openapi.json", "/", "/docs", "/v1/jobs"])
def test_a_head_is_answered_as_a_get_without_its_content(http: TestClient, path: str) -> None:
    got, asked = http.get(path), http.head(path)

    assert asked.status_code == got.status_code
    assert asked.headers["content-type"] == got.headers["content-type"]


@pytest.mark.parametrize(
    ("path", "there_are"),
    [
        ("/v1/jobs", "there are cursor, label, limit, name, order, project, state, verdict"),
        (JOB, "there is none here"),
        (f"{JOB}/mesh", "there is none here"),
        (f"{JOB}/events", "there is none here"),
    ],
)
def test_a_query_parameter_nobody_knows_is_refused_with_those_there_are(
    http: TestClient, path: str, there_are: str
) -> None:
    answer = http.get(path, params={"labels": "a"})

    assert answer.status_code == 422
    assert answer.json()["detail"] == f"unknown query parameter 'labels'; {there_are}"


def test_a_misspelt_parameter_of_a_write_is_refused_too(http: TestClient) -> None:
    for answer in (http.post("/v1/jobs?option=1"), http.delete(f"{JOB}?force=1")):
        assert answer.status_code == 422
        assert "unknown query parameter" in answer.json()["detail"]


@pytest.mark.parametrize("name", ["state", "limit", "cursor", "name"])
def test_a_query_parameter_of_which_one_would_be_ignored_is_refused(
    http: TestClient, name: str
) -> None:
    answer = http.get("/v1/jobs", params=[(name, "1"), (name, "2")])

    assert answer.status_code == 422
    assert answer.json()["detail"] == f"query parameter '{name}' is there 2 times; send it once"


def test_labels_may_be_repeated(http: TestClient) -> None:
    answer = http.get("/v1/jobs", params=[("label", "a"), ("label", "b")])

    assert answer.status_code == 503  # nothing is wrong with it, and there is nobody to ask


def test_a_probe_may_be_asked_with_what_it_does_not_know(http: TestClient) -> None:
    assert http.get("/livez?at=1").status_code == 200


def test_a_path_with_a_slash_too_many_is_not_found_and_not_redirected(http: TestClient) -> None:
    answer = http.get("/v1/jobs/", follow_redirects=False)

    assert answer.status_code == 404
    assert answer.headers["content-type"] == "application/problem+json"
