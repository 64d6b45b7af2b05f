"""Submitting: waiting for the answer, repeating a request, files sent before, a full queue."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import httpx2
import pytest

from meshcone.files import MeshFile
from service.client import Client
from service.stack import Stack
from tests.holding import Hold
from worker.broker.connections import connect_text
from worker.jobs.idempotency import KeyClaims, key_place
from worker.jobs.identifiers import new_job_id
from worker.settings import WorkerSettings


@pytest.fixture
def http(stack: Stack) -> Iterator[httpx2.Client]:
    with httpx2.Client(base_url=stack.url, timeout=60, trust_env=False) as client:
        yield client


def submit(
    http: httpx2.Client,
    source: MeshFile,
    reference: MeshFile,
    headers: dict[str, str] | None = None,
    **fields: Any,
) -> httpx2.Response:
    return http.post(
        "/v1/jobs",
        files={"source": (source.name, source.data), "reference": (reference.name, reference.data)},
        data={"options": "{}", **fields},
        headers=headers,
    )


def problem_type(answer: httpx2.Response) -> str:
    assert answer.headers["content-type"] == "application/problem+json"
    return str(answer.json()["type"]).rpartition(":")[2]


def put_blob(http: httpx2.Client, data: bytes, digest: str | None = None) -> httpx2.Response:
    return http.put(f"/v1/blobs/{digest or hashlib.sha256(data).hexdigest()}", content=data)


def test_a_client_that_prefers_to_wait_gets_the_finished_job(
    http: httpx2.Client, client: Client, rough_ball: MeshFile, ball: MeshFile
) -> None:
    job = submit(http, rough_ball, ball, key := {"Idempotency-Key": new_job_id()}).json()
    client.wait(job["id"])  # how long the work takes is not what is tested

    answer = submit(http, rough_ball, ball, key | {"Prefer": "respond-async, wait=30"})

    assert answer.status_code == 200
    assert answer.headers["preference-applied"] == "wait=30"
    assert answer.json()["state"] == "succeeded"
    assert http.get(answer.json()["links"]["mesh"]).status_code == 200


def test_waiting_has_an_end(
    http: httpx2.Client, hold: Hold, rough_ball: MeshFile, ball: MeshFile
) -> None:
    answer = submit(http, hold.mesh(rough_ball), ball, {"Prefer": "wait=0"})

    assert answer.status_code == 202
    assert answer.json()["state"] in ("queued", "running")


def test_a_longer_wait_than_is_granted_is_said_to_be_shorter(
    http: httpx2.Client, rough_ball: MeshFile, ball: MeshFile
) -> None:
    answer = submit(http, rough_ball, ball, {"Prefer": "wait=3600"})

    assert answer.headers["preference-applied"] == "wait=30"


def test_a_request_that_is_repeated_makes_one_job(
    http: httpx2.Client, client: Client, rough_ball: MeshFile, ball: MeshFile
) -> None:
    label, key = new_job_id(), {"Idempotency-Key": new_job_id()}

    first = submit(http, rough_ball, ball, key, label=label)
    again = submit(http, rough_ball, ball, key, label=label)

    assert first.status_code == 202
    assert again.status_code in (200, 202)
    assert again.headers["location"] == first.headers["location"]
    assert [job.id for job in client.jobs(label=label).jobs] == [first.json()["id"]]


def test_requests_sent_at_once_under_one_key_make_one_job(
    stack: Stack, client: Client, rough_ball: MeshFile, ball: MeshFile
) -> None:
    label, key = new_job_id(), {"Idempotency-Key": new_job_id()}

    def send(_: int) -> int:
        with httpx2.Client(base_url=stack.url, timeout=60, trust_env=False) as http:
            return submit(http, rough_ball, ball, key, label=label).status_code

    with ThreadPoolExecutor(8) as pool:
        codes = set(pool.map(send, range(8)))

    assert codes <= {200, 202, 409}
    assert len(client.jobs(label=label).jobs) == 1


def test_a_key_stands_for_one_content(
    http: httpx2.Client, rough_ball: MeshFile, ball: MeshFile
) -> None:
    key = {"Idempotency-Key": new_job_id()}
    submit(http, rough_ball, ball, key)

    for answer in (
        submit(http, ball, rough_ball, key),
        submit(http, rough_ball, ball, key, options='{"seed": 7}'),
        submit(http, rough_ball, ball, key, label="another"),
    ):
        assert (answer.status_code, problem_type(answer)) == (422, "key-reused")


def test_a_key_whose_request_is_under_way_is_a_conflict(
    http: httpx2.Client, stack: Stack, rough_ball: MeshFile, ball: MeshFile
) -> None:
    key = new_job_id()
    with connect_text(stack.redis_url) as redis:
        claims = KeyClaims(redis)
        claim = claims.claim(key_place("", key))  # what another API process does meanwhile

        during = submit(http, rough_ball, ball, {"Idempotency-Key": key})
        claims.release(claim)
        after = submit(http, rough_ball, ball, {"Idempotency-Key": key})

    assert (during.status_code, problem_type(during)) == (409, "key-in-use")
    assert during.headers["retry-after"]
    assert after.status_code == 202


def test_a_refused_request_does_not_use_up_its_key(
    http: httpx2.Client, rough_ball: MeshFile, ball: MeshFile
) -> None:
    key = {"Idempotency-Key": new_job_id()}

    refused = submit(http, MeshFile("rough.obj", b"nonsense"), ball, key)
    corrected = submit(http, rough_ball, ball, key)

    assert refused.status_code == 422
    assert corrected.status_code == 202


def test_the_key_of_a_deleted_job_is_gone_with_it(
    http: httpx2.Client, client: Client, rough_ball: MeshFile, ball: MeshFile
) -> None:
    headers = {"Idempotency-Key": new_job_id()}
    job = client.wait(submit(http, rough_ball, ball, headers).json()["id"])
    client.delete(job.id)

    answer = submit(http, rough_ball, ball, headers)

    assert (answer.status_code, problem_type(answer)) == (410, "gone")


def test_a_file_is_sent_once_and_named_by_its_hash(
    http: httpx2.Client, client: Client, rough_ball: MeshFile, ball: MeshFile
) -> None:
    stored = put_blob(http, ball.data).json()
    named = json.dumps({"name": "ball.obj", "sha256": stored["sha256"]})

    answer = http.post(
        "/v1/jobs",
        files={"source": (rough_ball.name, rough_ball.data)},
        data={"options": "{}", "reference": named},
    )

    job = answer.json()
    assert stored["size"] == len(ball.data)
    assert client.wait(job["id"]).state == "succeeded"
    assert job["reference"] == {
        "name": "ball.obj",
        "size": len(ball.data),
        "sha256": stored["sha256"],
        "link": f"/v1/jobs/{job['id']}/reference",
        "url": None,
    }


def test_a_stored_file_is_asked_for_by_its_hash(http: httpx2.Client) -> None:
    data = new_job_id().encode()
    path = f"/v1/blobs/{hashlib.sha256(data).hexdigest()}"

    before = http.head(path)
    created, repeated = put_blob(http, data), put_blob(http, data)
    after = http.head(path)

    assert before.status_code == 404
    assert (created.status_code, repeated.status_code) == (201, 200)
    assert (after.status_code, after.headers["content-length"]) == (200, str(len(data)))


def test_a_file_whose_content_has_another_hash_is_not_kept(http: httpx2.Client) -> None:
    meant, sent = new_job_id().encode(), new_job_id().encode()
    digest = hashlib.sha256(meant).hexdigest()

    answer = put_blob(http, sent, digest)

    assert (answer.status_code, problem_type(answer)) == (422, "hash-mismatch")
    assert hashlib.sha256(sent).hexdigest() in answer.json()["detail"]
    assert http.head(f"/v1/blobs/{digest}").status_code == 404


def test_a_hash_that_stands_for_nothing_is_told_where_to_send_the_file(
    http: httpx2.Client, ball: MeshFile
) -> None:
    named = json.dumps({"name": "mug.obj", "sha256": "0" * 64})

    answer = http.post(
        "/v1/jobs",
        files={"reference": (ball.name, ball.data)},
        data={"options": "{}", "source": named},
    )

    assert (answer.status_code, answer.json()["file"]) == (422, "mug.obj")
    assert "PUT /v1/blobs/" in answer.json()["detail"]


def test_a_bad_file_named_by_its_hash_is_refused_at_once(
    http: httpx2.Client, ball: MeshFile
) -> None:
    stored = put_blob(http, b"Dear diary,\n").json()

    answer = http.post(
        "/v1/jobs",
        files={"reference": (ball.name, ball.data)},
        data={
            "options": "{}",
            "source": json.dumps({"name": "notes.obj", "sha256": stored["sha256"]}),
        },
    )

    assert (answer.status_code, answer.json()["file"]) == (422, "notes.obj")


def test_a_full_queue_is_a_problem_that_passes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rough_ball: MeshFile, ball: MeshFile
) -> None:
    monkeypatch.setenv("MESHCONE_QUEUE_CAPACITY", "2")
    idle = Stack(
        WorkerSettings(data_dir=tmp_path),
        workers=0,  # so that it is never ready, only alive
        log=tmp_path / "log",
        given_up=lambda: is_alive(idle.url),
    )
    with idle, httpx2.Client(base_url=idle.url, timeout=60, trust_env=False) as http:
        accepted = [submit(http, rough_ball, ball) for _ in range(2)]
        refused = submit(http, rough_ball, ball)
        http.post(accepted[0].json()["links"]["cancel"])
        after = submit(http, rough_ball, ball)

    assert [answer.status_code for answer in accepted] == [202, 202]
    assert (refused.status_code, problem_type(refused)) == (503, "queue-full")
    assert int(refused.headers["retry-after"]) >= 1
    assert after.status_code == 202


def is_alive(url: str) -> bool:
    try:
        return httpx2.get(f"{url}/livez", timeout=5, trust_env=False).is_success
    except httpx2.TransportError:
        return False
