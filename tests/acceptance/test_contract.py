"""The running service against its own description: whatever is sent, what comes back is in it.

Schemathesis makes requests from the OpenAPI document, sound and unsound ones, and compares
each answer with it: status, media type, headers, schema; and no answer is a 500.
"""

from __future__ import annotations

import hashlib
import random
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import requests
import schemathesis
from hypothesis import HealthCheck, Phase, settings
from schemathesis import Case
from schemathesis.specs.openapi.checks import positive_data_acceptance

from meshcone.files import MeshFile
from service.client import Client
from service.problems import TYPE_PREFIX
from service.stack import Stack
from tests.holding import Hold
from tests.integration.waiting import wait_for
from worker.jobs.identifiers import new_job_id

# The application's own, byte for byte, as another test checks.
schema = schemathesis.openapi.from_path(Path(__file__).parents[2] / "openapi" / "openapi.json")

TIMEOUT = 60  # seconds
PROBLEM = "application/problem+json"

bounded = settings(
    max_examples=20,
    deadline=None,
    phases=[Phase.explicit, Phase.generate],
    suppress_health_check=list(HealthCheck),
    derandomize=True,
)


@pytest.fixture(scope="module")
def finished_jobs(stack: Stack, rough_ball: MeshFile, ball: MeshFile) -> list[str]:
    """Ids to put into paths: of a job that refined, and of one that measured."""
    with Client(stack.url) as client:
        done = client.wait(client.submit(rough_ball, ball).id)
        measured = client.wait(client.submit(rough_ball, ball, {"mode": "measure"}).id)
    return [done.id, measured.id]


@pytest.fixture(scope="module")
def session() -> Iterator[requests.Session]:
    with requests.Session() as opened:
        opened.trust_env = False  # a proxy cannot reach this machine
        yield opened


@schema.parametrize()
@bounded
def test_every_answer_is_as_described(
    case: Case, stack: Stack, session: requests.Session, finished_jobs: list[str]
) -> None:
    aim_at_a_job(case, finished_jobs)

    answer = case.call(base_url=stack.url, session=session, timeout=TIMEOUT)

    # A file of random bytes is no mesh, and an id of nothing is of nothing: both are said.
    case.validate_response(answer, excluded_checks=[positive_data_acceptance])
    if answer.status_code >= 400 and case.method != "HEAD":
        assert_problem(answer)


def aim_at_a_job(case: Case, jobs: list[str]) -> None:
    """Half of the requests are about a job there is; none of them removes it."""
    if "job_id" in case.path_parameters and case.method != "DELETE":
        choice = random.Random(str(case.path_parameters["job_id"]))  # noqa: S311 - no secret
        if choice.random() < 0.5:
            case.path_parameters["job_id"] = choice.choice(jobs)


def assert_problem(answer: requests.Response | schemathesis.Response) -> None:
    problem = answer.json()
    # A string, or schemathesis' list of them.
    assert answer.headers["content-type"] in (PROBLEM, [PROBLEM])
    assert problem["type"].startswith(TYPE_PREFIX)
    assert problem["status"] == answer.status_code
    assert "\n" not in problem["detail"]


@dataclass(frozen=True)
class Described:
    """Makes requests, and compares each answer with the description of its operation."""

    url: str
    session: requests.Session

    def __call__(
        self, method: str, template: str, expected: int, name: str = "", **request: Any
    ) -> requests.Response:
        path = template.format(job_id=name, batch_id=name, sha256=name)
        answer = self.session.request(method, self.url + path, timeout=TIMEOUT, **request)
        assert answer.status_code == expected, answer.text
        schema[template][method].validate_response(answer)
        if expected >= 400 and method != "HEAD":
            assert_problem(answer)
        return answer


@pytest.fixture
def call(stack: Stack, session: requests.Session) -> Described:
    return Described(stack.url, session)


@pytest.fixture
def form(rough_ball: MeshFile, ball: MeshFile) -> dict[str, Any]:
    return form_of(rough_ball, ball)


def form_of(source: MeshFile, reference: MeshFile) -> dict[str, Any]:
    files = [
        ("source", (source.name, source.data)),
        ("reference", (reference.name, reference.data)),
    ]
    return {"files": files, "data": {"options": "{}"}}


def test_a_file_sent_before_is_answered_as_described(call: Described) -> None:
    data = new_job_id().encode()
    sha256 = hashlib.sha256(data).hexdigest()

    call("HEAD", "/v1/blobs/{sha256}", 404, sha256)
    call("PUT", "/v1/blobs/{sha256}", 422, sha256, data=b"other")
    call("PUT", "/v1/blobs/{sha256}", 201, sha256, data=data)
    call("PUT", "/v1/blobs/{sha256}", 200, sha256, data=data)
    call("HEAD", "/v1/blobs/{sha256}", 200, sha256)


def test_a_job_and_its_results_are_answered_as_described(
    call: Described, form: dict[str, Any]
) -> None:
    key = {"Idempotency-Key": new_job_id()}
    call("POST", "/v1/jobs", 202, headers=key, **form)
    other = {**form, "data": {"options": "{}", "label": "another"}}
    call("POST", "/v1/jobs", 422, headers=key, **other)
    job = call("POST", "/v1/jobs", 200, headers={**key, "Prefer": "wait=30"}, **form).json()["id"]

    call("GET", "/v1/jobs", 200, params={"limit": 1})
    call("GET", "/v1/jobs/{job_id}", 200, job)
    call("GET", "/v1/jobs/{job_id}/events", 200, job)
    call("GET", "/v1/jobs/{job_id}/diagnostics", 200, job)
    call("POST", "/v1/jobs/{job_id}/cancel", 409, job)
    for name in ("mesh", "report", "certificate", "heatmap.glb", "preview.glb", "diagnostics.csv"):
        template = f"/v1/jobs/{{job_id}}/{name}"
        tag = call("GET", template, 200, job).headers["etag"]
        call("GET", template, 304, job, headers={"If-None-Match": tag})
        call("GET", template, 206, job, headers={"Range": "bytes=0-9"})
        call("GET", template, 416, job, headers={"Range": "bytes=999999999-"})


def test_the_end_of_a_job_is_answered_as_described(
    call: Described, hold: Hold, rough_ball: MeshFile, ball: MeshFile
) -> None:
    job = call("POST", "/v1/jobs", 202, **form_of(hold.mesh(rough_ball), ball)).json()["id"]

    call("GET", "/v1/jobs/{job_id}/mesh", 409, job)
    call("DELETE", "/v1/jobs/{job_id}", 409, job)
    # Queued or running: that is a race, and either answer is right.
    call.session.post(f"{call.url}/v1/jobs/{job}/cancel", timeout=TIMEOUT)
    call("GET", "/v1/jobs/{job_id}/events", 200, job)  # until it has ended
    call("POST", "/v1/jobs/{job_id}/cancel", 200, job)
    call("GET", "/v1/jobs/{job_id}/report", 409, job)
    call("DELETE", "/v1/jobs/{job_id}", 204, job)
    call("GET", "/v1/jobs/{job_id}", 404, job)


def test_a_batch_is_answered_as_described(
    call: Described, hold: Hold, rough_ball: MeshFile, ball: MeshFile
) -> None:
    source, reference = (sent_before(call, mesh) for mesh in (hold.mesh(rough_ball), ball))
    document = {"pairs": [{"source": source, "reference": reference}]}

    batch = call("POST", "/v1/batches", 202, json=document).json()["id"]
    for tail in ("result", "junit.xml", "sarif.json", "summary.md"):
        call("GET", f"/v1/batches/{{batch_id}}/{tail}", 409, batch)
    call("DELETE", "/v1/batches/{batch_id}", 409, batch)
    call("POST", "/v1/batches/{batch_id}/cancel", 202, batch)
    wait_for(
        lambda: call("GET", "/v1/batches/{batch_id}", 200, batch).json()["state"] == "finished"
    )
    call("POST", "/v1/batches/{batch_id}/cancel", 409, batch)
    call("GET", "/v1/batches", 200, params={"limit": 1})
    call("GET", "/v1/batches/{batch_id}/jobs", 200, batch)
    for tail in ("result", "junit.xml", "sarif.json", "summary.md"):
        call("GET", f"/v1/batches/{{batch_id}}/{tail}", 200, batch)
    call("DELETE", "/v1/batches/{batch_id}", 204, batch)
    call("GET", "/v1/batches/{batch_id}", 404, batch)


def sent_before(call: Described, mesh: MeshFile) -> dict[str, str]:
    sha256 = hashlib.sha256(mesh.data).hexdigest()
    call.session.put(f"{call.url}/v1/blobs/{sha256}", data=mesh.data, timeout=TIMEOUT)
    return {"name": mesh.name, "sha256": sha256}
