"""What a key of one project learns of the files that others have sent: nothing."""

from __future__ import annotations

import json

from httpx2 import Response
from starlette.testclient import TestClient

from tests.integration.projects.callers import (
    Caller,
    content,
    digest_of,
    finish,
    told,
)


def test_a_file_that_another_project_has_sent_is_not_there(owner: Caller, stranger: Caller) -> None:
    data = content()
    path = f"/v1/blobs/{digest_of(data)}"
    assert owner("PUT", path, content=data).status_code == 201
    assert owner("HEAD", path).status_code == 200

    foreign, unknown = stranger("HEAD", path), stranger("HEAD", f"/v1/blobs/{'0' * 63}1")

    assert told(foreign) == told(unknown)
    assert foreign.status_code == 404


def test_a_file_that_another_project_has_sent_is_new_all_the_same(
    owner: Caller, stranger: Caller
) -> None:
    data = content()
    path = f"/v1/blobs/{digest_of(data)}"
    owner("PUT", path, content=data)

    first, second = stranger("PUT", path, content=data), stranger("PUT", path, content=data)

    assert (first.status_code, second.status_code) == (201, 200)
    assert stranger("HEAD", path).status_code == 200


def named(caller: Caller, digest: str) -> Response:
    blob = json.dumps({"name": "lantern.obj", "sha256": digest})
    # Parts without a file name: all in one list, they make the form a multipart one.
    parts = [("source", (None, blob)), ("options", (None, '{"mode": "audit"}'))]
    return caller("POST", "/v1/jobs", files=parts)


def test_a_job_can_name_the_files_of_its_project_alone(
    http: TestClient, owner: Caller, stranger: Caller, admin: Caller
) -> None:
    sent = content()
    made = finish(http, str(owner.send(sent).json()["id"]))
    has = [digest_of(sent), digest_of(made["mesh"])]

    for digest in has:
        foreign, unknown = named(stranger, digest), named(stranger, "f" * 64)
        assert foreign.status_code == unknown.status_code == 422
        assert foreign.json()["detail"].replace(digest, "f" * 64) == unknown.json()["detail"]
    assert named(owner, has[0]).status_code == 202
    assert named(admin, has[0]).status_code == 202


def test_a_file_goes_from_a_project_with_its_last_job(
    http: TestClient, owner: Caller, stranger: Caller
) -> None:
    mesh = content()
    jobs = [str(owner.send(mesh).json()["id"]) for _ in range(2)]
    stranger.send(mesh)
    path = f"/v1/blobs/{digest_of(mesh)}"

    for job_id in jobs:
        assert owner("HEAD", path).status_code == 200
        finish(http, job_id)
        assert owner("DELETE", f"/v1/jobs/{job_id}").status_code == 204

    assert owner("HEAD", path).status_code == 404
    assert stranger("HEAD", path).status_code == 200
