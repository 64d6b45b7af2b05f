"""What a key of one project learns of another's jobs and files: nothing."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import anyio
import pytest
from redis import Redis
from starlette.testclient import TestClient

from meshcone.files import MeshFile
from service.api.app import create_app
from service.cli.openapi import describe_api
from service.settings import ServiceSettings
from tests.integration.projects.callers import (
    Caller,
    caller,
    content,
    finish,
    told,
)
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.identifiers import new_job_id


def operations() -> list[tuple[str, str]]:
    """Everything that can be asked of one job, as the API describes it, and HEAD."""
    described = [
        (method.upper(), path)
        for path, methods in json.loads(describe_api())["paths"].items()
        for method in methods
        if "{job_id}" in path
    ]
    return described + [("HEAD", path) for method, path in described if method == "GET"]


@pytest.mark.parametrize(("method", "path"), operations())
def test_a_job_of_another_project_is_answered_for_as_one_that_never_was(
    stranger: Caller, redis: Redis, job: str, method: str, path: str
) -> None:
    def ask(job_id: str) -> tuple[Any, Any]:
        before = commands(redis)
        answer = stranger(method, path.format(job_id=job_id, name="lantern.obj"))
        return told(answer), {
            name: count - before.get(name, 0)
            for name, count in commands(redis).items()
            if count != before.get(name, 0)
        }

    ask(new_job_id())  # what a first request of its kind does once
    (foreign, foreign_work), (unknown, unknown_work) = ask(job), ask(new_job_id())

    assert foreign[0] == 404
    assert foreign == unknown
    assert foreign_work == unknown_work


def commands(redis: Redis) -> dict[str, int]:
    """How often the broker has run each command."""
    return {name: each["calls"] for name, each in redis.info("commandstats").items()}


@pytest.mark.parametrize(("method", "path"), operations())
def test_an_admin_has_the_jobs_of_all_projects(
    owner: Caller, admin: Caller, method: str, path: str
) -> None:
    job_id = str(owner.send(content()).json()["id"])
    finish(owner.http, job_id)

    answer = admin(method, path.format(job_id=job_id, name="lantern.obj"))

    never_made = ("/reference", "resources/{name}")  # an audit's only file is its source
    assert (answer.status_code == 404) == path.endswith(never_made)
    assert answer.status_code in (200, 204, 404, 409)


def test_lists_hold_the_jobs_of_a_project_alone(
    owner: Caller, stranger: Caller, admin: Caller, job: str
) -> None:
    filters: list[dict[str, Any]] = [
        {},
        {"label": "of the owner"},
        {"state": "succeeded"},
        {"verdict": "pass"},
        {"name": "lantern"},
        {"project": "lamps"},
    ]

    for each in filters:
        assert job in owner.listed(**each)
        assert job in admin.listed(**each)
        assert job not in stranger.listed(**each)
    assert job not in admin.listed(project="chairs")


def test_the_jobs_of_others_are_not_even_a_next_page(
    owner: Caller, http: TestClient, redis: Redis
) -> None:
    newcomer = caller(http, redis, "newcomers")
    for _ in range(3):
        owner.send(content())

    answer = newcomer("GET", "/v1/jobs", params={"limit": 1, "name": "lantern"})

    assert answer.json() == {"jobs": [], "next": None}


def test_the_live_list_holds_the_jobs_of_a_project_alone(
    http: TestClient, owner: Caller, stranger: Caller, job: str
) -> None:
    own = stranger.send(content()).json()["id"]

    assert job in first_live_list(http, owner)
    assert own in first_live_list(http, stranger)
    assert job not in first_live_list(http, stranger)


def first_live_list(http: TestClient, caller: Caller) -> list[str]:
    """The ids that the page is told first; the stream itself has no end."""
    scope = {
        "type": "http",
        "method": "GET",
        "path": "/dashboard/events",
        "query_string": b"",
        "headers": [(b"authorization", f"Bearer {caller.token}".encode())],
    }
    found: list[str] = []

    async def follow() -> None:
        with anyio.CancelScope() as until_told:

            async def receive() -> dict[str, Any]:
                await anyio.sleep_forever()
                return {}

            async def send(message: Any) -> None:
                body = message.get("body", b"")
                if b"event: jobs" in body:
                    [line] = [each for each in body.splitlines() if each.startswith(b"data: ")]
                    found.extend(json.loads(line.removeprefix(b"data: "))["order"])
                    until_told.cancel()

            await http.app(scope, receive, send)  # type: ignore[arg-type]

    assert http.portal is not None
    http.portal.call(follow)
    return found


def test_a_label_is_deleted_in_its_project_alone(
    http: TestClient, owner: Caller, stranger: Caller
) -> None:
    mine, other = (
        str(each.send(content(), label="night").json()["id"]) for each in (owner, stranger)
    )
    for job_id in (mine, other):
        finish(http, job_id)

    answer = stranger("DELETE", "/v1/jobs", params={"label": "night"})

    assert answer.json() == {"deleted": 1, "not_finished": 0, "next": None}
    assert mine in owner.listed(label="night")


def test_an_idempotency_key_of_another_project_is_another_key(
    owner: Caller, stranger: Caller
) -> None:
    mesh, key = content(), {"Idempotency-Key": new_job_id()}

    jobs = {each.send(mesh, **key).json()["id"] for each in (owner, owner, stranger)}

    assert len(jobs) == 2


@pytest.mark.usefixtures("job")
def test_metrics_are_those_of_the_project(http: TestClient, redis: Redis, admin: Caller) -> None:
    newcomer = caller(http, redis, "counting")
    finish(http, str(newcomer.send(content()).json()["id"]))
    newcomer.send(content())

    own = newcomer("GET", "/metrics").text
    whole = admin("GET", "/metrics").text

    assert 'meshcone_jobs{state="succeeded"} 1.0\n' in own
    assert "meshcone_queue_depth 1.0\n" in own
    assert 'meshcone_transitions_total{from="new",to="queued"} 2.0\n' in own
    assert not any(word in own for word in ("workers", "webhooks", "project"))
    assert 'meshcone_project_jobs{project="counting",state="queued"} 1.0\n' in whole
    assert "meshcone_workers" in whole


def test_a_job_says_whose_it_is(owner: Caller, job: str) -> None:
    assert owner("GET", f"/v1/jobs/{job}").json()["project"] == "lamps"


def test_deleting_needs_a_scope_of_its_own(http: TestClient, redis: Redis, job: str) -> None:
    reader = caller(http, redis, "lamps", "submit", "read")

    assert reader("DELETE", f"/v1/jobs/{job}").status_code == 403
    assert reader("DELETE", "/v1/jobs", params={"label": "of the owner"}).status_code == 403


def test_all_keys_of_a_project_share_its_quota(
    broker: EmbeddedBroker, redis: Redis, tmp_path: Path, ball: MeshFile
) -> None:
    settings = ServiceSettings(redis_url=broker.url, data_dir=tmp_path, project_active_jobs=1)
    with TestClient(create_app(settings)) as http:
        one, other = (caller(http, redis, "small") for _ in range(2))
        elsewhere = caller(http, redis, "smaller")

        assert one.send(ball.data).status_code == 202
        refused = other.send(ball.data)
        assert elsewhere.send(ball.data).status_code == 202

    assert refused.status_code == 429
    assert "1 jobs of this project are queued or running" in refused.json()["detail"]
