"""What a key of one project learns of another's jobs and files: nothing."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import anyio
import pytest
from httpx2 import Response
from redis import Redis
from starlette.testclient import TestClient

from meshcone.files import MeshFile
from service.access.keys import KeyStore, Scope
from service.api.app import create_app
from service.api.context import Context
from service.cli.openapi import describe_api
from service.dashboard.routes import router
from service.settings import ServiceSettings
from worker.broker.connections import connect_text
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.identifiers import new_job_id
from worker.jobs.records import Artifact

SCOPES: tuple[Scope, ...] = ("submit", "read", "delete")
TRIANGLE = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n# "
VARYING = {"x-request-id", "ratelimit", "ratelimit-policy", "date"}


@dataclass(frozen=True)
class Caller:
    """Somebody with a key."""

    http: TestClient
    token: str

    def __call__(self, method: str, path: str, **request: Any) -> Response:
        headers = {"Authorization": f"Bearer {self.token}", **request.pop("headers", {})}
        return self.http.request(method, path, headers=headers, **request)

    def send(self, source: bytes, label: str = "", **headers: str) -> Response:
        files = {"source": ("lantern.obj", source)}
        data = {"options": '{"mode": "audit"}', "label": label}
        return self("POST", "/v1/jobs", files=files, data=data, headers=headers)

    def listed(self, **filters: Any) -> list[str]:
        answer = self("GET", "/v1/jobs", params=filters)
        assert answer.status_code == 200, answer.text
        return [job["id"] for job in answer.json()["jobs"]]


@pytest.fixture(scope="module")
def http(broker: EmbeddedBroker, tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    """An application that asks for keys."""
    settings = ServiceSettings(redis_url=broker.url, data_dir=tmp_path_factory.mktemp("projects"))
    with TestClient(create_app(settings, pages=router)) as client:
        yield client


@pytest.fixture(scope="module")
def redis(broker: EmbeddedBroker) -> Iterator[Redis]:
    with connect_text(broker.url) as client:
        yield client


def caller(http: TestClient, redis: Redis, project: str, *scopes: Scope) -> Caller:
    made = KeyStore(redis).create(f"of {project}", scopes or SCOPES, project=project)
    return Caller(http, made.token)


@pytest.fixture(scope="module")
def owner(http: TestClient, redis: Redis) -> Caller:
    return caller(http, redis, "lamps")


@pytest.fixture(scope="module")
def stranger(http: TestClient, redis: Redis) -> Caller:
    return caller(http, redis, "chairs")


@pytest.fixture(scope="module")
def admin(http: TestClient, redis: Redis) -> Caller:
    return caller(http, redis, "staff", "admin")


def content() -> bytes:
    """A mesh that nobody has sent."""
    return TRIANGLE + new_job_id().encode()


def digest_of(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


@pytest.fixture(scope="module")
def job(owner: Caller) -> str:
    """A job of the owner's that has made a file of each kind."""
    job_id = str(owner.send(content(), label="of the owner").json()["id"])
    finish(owner.http, job_id)
    return job_id


def finish(http: TestClient, job_id: str) -> dict[str, bytes]:
    """Have a job succeed as a worker would; what it has made."""
    context: Context = http.app.state.context  # type: ignore[attr-defined]
    names = (
        "mesh", "report", "certificate", "preview", "heatmap", "pictures", "thumbnail",
        "diagnostics_csv",
    )  # fmt: skip
    made = {name: json.dumps({"solver": name, "id": job_id}).encode() for name in names}
    digests = context.blobs.put_all(made.values(), job_id)
    artifacts = {
        name: Artifact(digest=digest, media_type="application/json", filename=name, size=len(data))
        for (name, data), digest in zip(made.items(), digests, strict=True)
    }
    context.ledger.succeed(job_id, context.ledger.begin(job_id), artifacts, verdict="pass")
    return made


def operations() -> list[tuple[str, str]]:
    """Everything that can be asked of one job, as the API describes it, and HEAD."""
    described = [
        (method.upper(), path)
        for path, methods in json.loads(describe_api())["paths"].items()
        for method in methods
        if "{job_id}" in path
    ]
    return described + [("HEAD", path) for method, path in described if method == "GET"]


def told(answer: Response) -> tuple[int, str, dict[str, str]]:
    headers = {name: each for name, each in answer.headers.items() if name not in VARYING}
    return answer.status_code, answer.text, headers


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
