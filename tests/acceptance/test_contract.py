"""The running service against its own description: whatever is sent, what comes back is in it.

Schemathesis makes requests from the OpenAPI document, sound and unsound ones, and compares
each answer with it: status, media type, headers, schema; and no answer is a 500.
"""

from __future__ import annotations

import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import requests
import schemathesis
from hypothesis import HealthCheck, Phase, settings
from schemathesis import Case
from schemathesis.specs.openapi.checks import positive_data_acceptance, unsupported_method

from meshcone.files import MeshFile
from service.client import Client
from service.problems import TYPE_PREFIX
from service.stack import Stack

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
    """Ids to put into paths: of a job that succeeded, and of one that was canceled or ended."""
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
    excluded = [positive_data_acceptance, unsupported_method]
    case.validate_response(answer, excluded_checks=excluded)
    if answer.status_code >= 400 and case.method != "HEAD":
        assert_problem(answer)


def aim_at_a_job(case: Case, jobs: list[str]) -> None:
    """Half of the requests are about a job there is; none of them removes it."""
    if "job_id" in case.path_parameters and case.method != "DELETE":
        choice = random.Random(str(case.path_parameters["job_id"]))  # noqa: S311 - no secret
        if choice.random() < 0.5:
            case.path_parameters["job_id"] = choice.choice(jobs)


def assert_problem(answer: Any) -> None:
    assert answer.headers["content-type"] == [PROBLEM]
    problem = answer.json()
    assert problem["type"].startswith(TYPE_PREFIX)
    assert problem["status"] == answer.status_code
    assert "\n" not in problem["detail"]
