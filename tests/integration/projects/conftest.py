"""Two projects, an admin, and a job of one of them."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from redis import Redis
from starlette.testclient import TestClient

from service.api.app import create_app
from service.dashboard.routes import router
from service.settings import ServiceSettings
from tests.integration.projects.callers import (
    Caller,
    caller,
    content,
    finish,
)
from worker.broker.connections import connect_text
from worker.broker.embedded import EmbeddedBroker


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


@pytest.fixture(scope="module")
def owner(http: TestClient, redis: Redis) -> Caller:
    return caller(http, redis, "lamps")


@pytest.fixture(scope="module")
def stranger(http: TestClient, redis: Redis) -> Caller:
    return caller(http, redis, "chairs")


@pytest.fixture(scope="module")
def admin(http: TestClient, redis: Redis) -> Caller:
    return caller(http, redis, "staff", "admin")


@pytest.fixture(scope="module")
def job(owner: Caller) -> str:
    """A job of the owner's that has made a file of each kind."""
    job_id = str(owner.send(content(), label="of the owner").json()["id"])
    finish(owner.http, job_id)
    return job_id
