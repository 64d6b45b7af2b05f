"""What `/readyz` says while something is wrong that no connection shows."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from pathlib import Path

import pytest
from redis import Redis
from rq import Worker
from rq.suspension import resume, suspend
from starlette.testclient import TestClient

from service.api.app import create_app
from service.settings import ServiceSettings
from tests.integration.jobs import make_job
from tests.integration.object_store import object_store
from tests.integration.waiting import wait_for
from worker.broker.connections import connect_bytes, connect_text
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.ledger import Ledger
from worker.jobs.queue import JobQueue


@pytest.fixture
def settings(tmp_path: Path) -> Iterator[ServiceSettings]:
    with EmbeddedBroker(tmp_path) as broker:
        yield ServiceSettings(redis_url=broker.url, data_dir=tmp_path, queue_capacity=1)


@pytest.fixture
def redis(settings: ServiceSettings) -> Iterator[Redis]:
    with connect_text(settings.required_redis_url()) as client:
        yield client


@pytest.fixture
def http(settings: ServiceSettings) -> Iterator[TestClient]:
    """The API of an installation that has one worker, by the broker's list."""
    app = create_app(settings, keys_required=False)
    with (
        connect_bytes(settings.required_redis_url()) as connection,
        TestClient(app, "http://127.0.0.1:8000", raise_server_exceptions=False) as client,
    ):
        queue = JobQueue(settings, connection).rq
        Worker([queue], connection=connection, serializer=queue.serializer).register_birth()
        yield client


def test_all_is_well(http: TestClient) -> None:
    answer = http.get("/readyz")

    assert (answer.status_code, answer.json()) == (
        200,
        {"status": "ok", "workers": 1, "reason": None},
    )


def test_a_broker_at_its_memory_limit_is_not_ready_until_it_has_room(
    http: TestClient, redis: Redis
) -> None:
    redis.config_set("maxmemory", 1)

    assert "at its memory limit" in unready(http)
    assert http.get("/livez").status_code == 200

    redis.config_set("maxmemory", 0)
    assert http.get("/readyz").status_code == 200


def test_a_broker_that_cannot_save_is_not_ready(
    http: TestClient, redis: Redis, settings: ServiceSettings
) -> None:
    name = redis.config_get("dbfilename")["dbfilename"]
    (settings.data_dir / "broker" / name / "in the way").mkdir(parents=True)
    redis.config_set("save", "3600 1")
    redis.config_set("stop-writes-on-bgsave-error", "yes")
    redis.bgsave()
    wait_for(lambda: redis.info("persistence")["rdb_last_bgsave_status"] == "err")

    assert "cannot save to its disk" in unready(http)

    redis.config_set("save", "")  # it would not end before it has saved


def test_a_file_store_that_cannot_be_written_is_not_ready(
    http: TestClient, settings: ServiceSettings
) -> None:
    (settings.data_dir / "blobs").rmdir()
    (settings.data_dir / "blobs").write_text("a file where the folder was")

    assert "the file store cannot be used: not a directory" in unready(http)


def test_a_directory_named_by_url_is_asked_as_well(
    settings: ServiceSettings, tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("a file where a folder should be")

    assert "the file store" in unready_with(f"file://{tmp_path}/file/blobs", settings)


def test_a_bucket_that_is_not_there_is_not_ready(
    settings: ServiceSettings, monkeypatch: pytest.MonkeyPatch
) -> None:
    with object_store("meshes") as server:
        for name, value in server.environment.items():
            monkeypatch.setenv(name, value)

        assert "file store" in unready_with("s3://another-bucket/prefix", settings)


def test_a_bucket_out_of_reach_is_not_ready(
    settings: ServiceSettings, monkeypatch: pytest.MonkeyPatch
) -> None:
    with socket.socket() as nobody:  # its port, once closed, is free
        nobody.bind(("127.0.0.1", 0))
        port = nobody.getsockname()[1]
    monkeypatch.setenv("AWS_ENDPOINT_URL", f"http://127.0.0.1:{port}")
    monkeypatch.setenv("AWS_ALLOW_HTTP", "true")
    monkeypatch.setenv("AWS_ACCESS_KEY_ID", "tests")
    monkeypatch.setenv("AWS_SECRET_ACCESS_KEY", "tests")

    assert "cannot be reached" in unready_with("s3://meshes/prefix", settings)


def test_a_full_queue_is_degraded_and_says_so(http: TestClient, redis: Redis) -> None:
    Ledger(redis).create(make_job())

    answer = http.get("/readyz")

    assert answer.status_code == 200
    assert answer.json()["status"] == "degraded"
    assert "MESHCONE_QUEUE_CAPACITY" in answer.json()["reason"]


def test_suspended_workers_are_degraded_until_they_are_resumed(
    http: TestClient, settings: ServiceSettings
) -> None:
    with connect_bytes(settings.required_redis_url()) as connection:
        suspend(connection)
        answer = http.get("/readyz")
        assert (answer.status_code, answer.json()["status"]) == (200, "degraded")
        assert "rq resume" in answer.json()["reason"]

        resume(connection)
        assert http.get("/readyz").json()["status"] == "ok"


def test_no_worker_is_not_ready(settings: ServiceSettings) -> None:
    with TestClient(create_app(settings, keys_required=False), "http://127.0.0.1:8000") as http:
        assert unready(http) == "no worker is running"


def unready(http: TestClient) -> str:
    """Why the service is not ready."""
    answer = http.get("/readyz")
    assert answer.status_code == 503
    said: str = answer.json()["detail"]
    return said


def unready_with(blob_url: str, settings: ServiceSettings) -> str:
    """Why a service with its files elsewhere is not ready."""
    elsewhere = settings.model_copy(update={"blob_url": blob_url})
    with TestClient(create_app(elsewhere, keys_required=False), "http://127.0.0.1:8000") as http:
        return unready(http)
