"""Looking after jobs: events, lists, cancel, delete, expiry."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx2
import pytest

from meshcone.files import MeshFile
from service.api.schemas import Job
from service.client import Client
from service.stack import Stack
from tests.holding import Hold
from tests.integration.waiting import PATIENCE, wait_for
from worker.broker.connections import connect_text
from worker.jobs.identifiers import new_job_id
from worker.jobs.ledger import Ledger


@pytest.fixture
def http(stack: Stack) -> Iterator[httpx2.Client]:
    with httpx2.Client(base_url=stack.url, timeout=60, trust_env=False) as client:
        yield client


@pytest.fixture
def ledger(stack: Stack) -> Iterator[Ledger]:
    with connect_text(stack.redis_url) as connection:
        yield Ledger(connection)


@pytest.fixture(scope="module")
def finished(stack: Stack, rough_ball: MeshFile, ball: MeshFile) -> Job:
    with Client(stack.url) as client:
        return client.wait(client.submit(rough_ball, ball).id)


def events_of(answer: httpx2.Response) -> list[dict[str, str]]:
    """What a browser would make of the stream."""
    blocks = [block for block in answer.text.split("\n\n") if "data: " in block]
    return [dict(line.split(": ", 1) for line in block.split("\n")) for block in blocks]


def states_in(events: list[dict[str, str]]) -> list[str]:
    return [json.loads(each["data"])["state"] for each in events if each["event"] == "state"]


def problem_type(answer: httpx2.Response) -> str:
    assert answer.headers["content-type"] == "application/problem+json"
    return str(answer.json()["type"]).rpartition(":")[2]


def test_events_tell_of_a_job_as_it_runs_and_end_with_it(
    http: httpx2.Client, client: Client, rough_ball: MeshFile, ball: MeshFile
) -> None:
    job = client.submit(rough_ball, ball)

    answer = http.get(f"/v1/jobs/{job.id}/events")

    events = events_of(answer)
    assert answer.headers["content-type"].startswith("text/event-stream")
    assert states_in(events) == ["queued", "running", "succeeded"]
    assert {"read", "solve", "quality"} <= {
        json.loads(each["data"])["stage"] for each in events if each["event"] == "progress"
    }


def test_events_go_on_where_the_connection_was_lost(http: httpx2.Client, finished: Job) -> None:
    path = f"/v1/jobs/{finished.id}/events"
    every = events_of(http.get(path))

    rest = events_of(http.get(path, headers={"Last-Event-ID": every[1]["id"]}))

    assert rest == every[2:]


def test_a_browser_that_has_seen_the_end_is_told_not_to_come_back(
    http: httpx2.Client, finished: Job
) -> None:
    path = f"/v1/jobs/{finished.id}/events"
    last = events_of(http.get(path))[-1]["id"]

    assert http.get(path, headers={"Last-Event-ID": last}).status_code == 204


def test_an_event_that_never_was_is_refused(http: httpx2.Client, finished: Job) -> None:
    headers = {"Last-Event-ID": "yesterday"}

    answer = http.get(f"/v1/jobs/{finished.id}/events", headers=headers)

    assert (answer.status_code, problem_type(answer)) == (422, "input")


def test_jobs_are_listed_by_label_state_and_verdict(
    http: httpx2.Client, client: Client, rough_ball: MeshFile, ball: MeshFile
) -> None:
    label = new_job_id()
    strict = {"gates": {"point_to_surface.mean": {"max": 0}}}
    lax = {"gates": {"point_to_surface.mean": {"max": 1}}}
    failing, passing = (
        client.wait(client.submit(rough_ball, ball, options, labels=[label]).id)
        for options in (strict, lax)
    )

    def listed(**query: Any) -> list[str]:
        answer = http.get("/v1/jobs", params={"label": label, **query})
        return [job["id"] for job in answer.json()["jobs"]]

    assert listed() == [passing.id, failing.id]
    assert listed(verdict="fail") == [failing.id]
    assert listed(verdict="pass", state="succeeded") == [passing.id]
    assert listed(state="failed") == []
    assert listed(label=[label, "another"]) == []


def test_a_cursor_can_be_neither_read_nor_made_up(
    http: httpx2.Client, client: Client, rough_ball: MeshFile, ball: MeshFile
) -> None:
    label = new_job_id()
    for _ in range(2):
        client.submit(rough_ball, ball, labels=[label])
    page = http.get("/v1/jobs", params={"label": label, "limit": 1}).json()

    following = http.get("/v1/jobs", params={"label": label, "cursor": page["next"]}).json()
    made_up = http.get("/v1/jobs", params={"cursor": page["jobs"][0]["id"]})

    assert page["jobs"][0]["id"] not in page["next"]
    assert len(following["jobs"]) == 1
    assert (made_up.status_code, problem_type(made_up)) == (422, "input")


def test_a_running_job_is_canceled_and_the_next_one_runs(
    http: httpx2.Client, client: Client, hold: Hold, rough_ball: MeshFile, ball: MeshFile
) -> None:
    held, waiting = (client.submit(source, ball) for source in (hold.mesh(rough_ball), rough_ball))
    wait_for(lambda: client.job(held.id).state == "running", PATIENCE)

    answer = http.post(f"/v1/jobs/{held.id}/cancel")

    canceled = client.wait(held.id, timeout=PATIENCE)
    assert answer.status_code == 202
    assert answer.json()["cancel_requested"] is not None
    assert (canceled.state, canceled.error) == ("canceled", None)
    assert client.wait(waiting.id, timeout=PATIENCE).state == "succeeded"


def test_a_queued_job_is_canceled_at_once_and_never_runs(
    http: httpx2.Client, client: Client, hold: Hold, rough_ball: MeshFile, ball: MeshFile
) -> None:
    held, waiting = (client.submit(source, ball) for source in (hold.mesh(rough_ball), rough_ball))

    first, again = (http.post(f"/v1/jobs/{waiting.id}/cancel") for _ in range(2))
    http.post(f"/v1/jobs/{held.id}/cancel")
    client.wait(held.id, timeout=PATIENCE)

    assert (first.status_code, first.json()["state"]) == (200, "canceled")
    assert again.json() == first.json()
    assert client.job(waiting.id).attempt == 0


def test_a_finished_job_can_no_longer_be_canceled(http: httpx2.Client, finished: Job) -> None:
    answer = http.post(f"/v1/jobs/{finished.id}/cancel")

    assert (answer.status_code, problem_type(answer)) == (409, "finished")


def test_a_canceled_job_has_no_results(
    http: httpx2.Client, client: Client, hold: Hold, rough_ball: MeshFile, ball: MeshFile
) -> None:
    job = client.submit(hold.mesh(rough_ball), ball)
    http.post(f"/v1/jobs/{job.id}/cancel")
    client.wait(job.id, timeout=PATIENCE)

    answer = http.get(f"/v1/jobs/{job.id}/mesh")

    assert (answer.status_code, problem_type(answer)) == (409, "job-failed")
    assert "canceled" in answer.json()["detail"]


def test_a_deleted_job_leaves_nothing(
    http: httpx2.Client, client: Client, data_dir: Path, rough_ball: MeshFile, ball: MeshFile
) -> None:
    nobody_elses = MeshFile("own.obj", rough_ball.data + f"# {new_job_id()}\n".encode())
    job = client.wait(client.submit(nobody_elses, ball).id)
    path = f"/v1/jobs/{job.id}"
    kept = blobs_of(http, job)
    assert kept <= stored(data_dir)

    answer = http.delete(path)

    assert answer.status_code == 204
    for gone in (path, f"{path}/mesh", f"{path}/events"):
        assert http.get(gone).status_code == 404
    wait_for(lambda: not kept & stored(data_dir))


def test_files_of_other_jobs_outlive_a_deleted_one(
    http: httpx2.Client, client: Client, rough_ball: MeshFile, ball: MeshFile
) -> None:
    one, twin = (client.wait(client.submit(rough_ball, ball, {"seed": 5}).id) for _ in range(2))

    http.delete(f"/v1/jobs/{one.id}")

    assert client.mesh(twin.id)
    assert http.head(f"/v1/blobs/{twin.reference.sha256}").status_code == 200


def test_a_job_that_has_not_ended_is_canceled_before_it_is_deleted(
    http: httpx2.Client, client: Client, hold: Hold, rough_ball: MeshFile, ball: MeshFile
) -> None:
    job = client.submit(hold.mesh(rough_ball), ball)

    refused = http.delete(f"/v1/jobs/{job.id}")
    http.post(f"/v1/jobs/{job.id}/cancel")
    client.wait(job.id, timeout=PATIENCE)

    assert (refused.status_code, problem_type(refused)) == (409, "not-finished")
    assert "cancel it first" in refused.json()["detail"]
    assert http.delete(f"/v1/jobs/{job.id}").status_code == 204


def test_an_expired_job_says_so(
    http: httpx2.Client, client: Client, ledger: Ledger, rough_ball: MeshFile, ball: MeshFile
) -> None:
    job = client.wait(client.submit(rough_ball, ball).id)
    path = f"/v1/jobs/{job.id}"

    ledger.expire(job.id)  # what the workers do when MESHCONE_RESULT_TTL is over

    shown = http.get(path).json()
    assert job.expires is not None
    assert (shown["state"], shown["links"]["mesh"]) == ("succeeded", None)
    assert shown["expired"] is not None
    for tail in ("mesh", "report", "events"):
        answer = http.get(f"{path}/{tail}")
        assert (answer.status_code, problem_type(answer)) == (410, "gone")
        assert "expired" in answer.json()["detail"]


def blobs_of(http: httpx2.Client, job: Job) -> set[str]:
    """Digests of the files that are of this job alone: its source and what depends on it."""
    results = [http.head(f"/v1/jobs/{job.id}/{name}") for name in ("mesh", "report")]
    return {
        job.source.sha256,
        *(answer.headers["etag"].removeprefix("W/").strip('"') for answer in results),
    }


def stored(data_dir: Path) -> set[str]:
    found = (data_dir / "blobs").rglob("*")
    return {path.name.partition(".")[0] for path in found if path.is_file()}
