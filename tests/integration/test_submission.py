"""Accepting a job while the broker comes and goes."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import pytest
from fastapi import FastAPI
from redis.exceptions import ConnectionError as RedisConnectionError
from starlette.testclient import TestClient

from meshcone.files import MeshFile
from meshcone.options import OPTIONS_VERSION
from service.api.app import create_app
from service.api.routes.events import Events
from service.settings import ServiceSettings
from worker.broker.connections import connect_bytes, connect_text
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.ledger_keys import BLOB_LEASES
from worker.jobs.queue import JobQueue


@pytest.mark.parametrize("reachable", [True, False], ids=["queue there", "queue gone"])
def test_a_job_in_the_ledger_is_accepted_whether_its_message_can_be_sent_or_not(
    tmp_path: Path, ball: MeshFile, rough_ball: MeshFile, reachable: bool
) -> None:
    with (
        EmbeddedBroker(tmp_path) as broker,
        TestClient(an_app(broker, tmp_path), "http://127.0.0.1:8000") as http,
        connect_bytes(f"unix://{tmp_path}/nobody.sock") as nobody,
    ):
        app: Any = http.app
        context = app.state.context
        if not reachable:
            app.state.context = replace(context, queue=JobQueue(context.settings, nobody))

        answer = http.post(
            "/v1/jobs",
            data={"options": "{}"},
            files={"source": ("rough.obj", rough_ball.data), "reference": ("b.obj", ball.data)},
        )

        assert answer.status_code == 202
        job = answer.json()["id"]
        assert context.ledger.get(job).state == "queued"
        assert (job in context.queue.waiting()) == reachable


class Unreachable:
    """The ledger's events, or its batches, once the broker cannot be reached any more."""

    def __init__(self, before: Any) -> None:
        self._before = before

    def __getattr__(self, name: str) -> Any:
        return getattr(self._before, name)

    async def wait_for_end(self, *_: object) -> None:
        raise RedisConnectionError("the broker is away")

    def _away(self, *_: object) -> None:
        raise RedisConnectionError("the broker is away")

    counts = unstage = _away


MUG = {"url": "https://assets.example.org/mug.glb"}
PAIR = {"source": MUG, "reference": MUG}


def test_a_job_that_cannot_be_waited_for_is_accepted_all_the_same(tmp_path: Path) -> None:
    with (
        EmbeddedBroker(tmp_path) as broker,
        TestClient(an_app(broker, tmp_path), "http://127.0.0.1:8000") as http,
    ):
        app: Any = http.app
        app.state.events = Events(cast(Any, Unreachable(None)), 1)

        answer = http.post("/v1/jobs", json=PAIR, headers={"Prefer": "wait=1"})

        assert answer.status_code == 202
        assert "Preference-Applied" not in answer.headers
        assert app.state.context.ledger.get(answer.json()["id"]).state == "queued"


def test_a_batch_whose_jobs_cannot_be_counted_is_accepted_all_the_same(tmp_path: Path) -> None:
    with (
        EmbeddedBroker(tmp_path) as broker,
        TestClient(an_app(broker, tmp_path), "http://127.0.0.1:8000") as http,
    ):
        app: Any = http.app
        context = app.state.context
        app.state.context = replace(context, batches=Unreachable(context.batches))

        answer = http.post("/v1/batches", json={"pairs": [PAIR, PAIR]})

        assert answer.status_code == 202
        assert answer.json()["counts"]["queued"] == 2
        assert context.batches.get(answer.json()["id"]).pairs == 2


def test_a_list_leaves_out_the_options_that_the_job_itself_shows_as_they_were_sent(
    tmp_path: Path, ball: MeshFile, rough_ball: MeshFile
) -> None:
    sent = {"mode": "measure", "seed": 7}
    with (
        EmbeddedBroker(tmp_path) as broker,
        TestClient(an_app(broker, tmp_path), "http://127.0.0.1:8000") as http,
    ):
        job = http.post(
            "/v1/jobs",
            data={"options": json.dumps(sent)},
            files={"source": ("rough.obj", rough_ball.data), "reference": ("b.obj", ball.data)},
        ).json()["id"]

        [listed] = http.get("/v1/jobs").json()["jobs"]
        assert "options" not in listed
        assert listed["mode"] == "measure"
        assert http.get(f"/v1/jobs/{job}").json()["options"] == sent
        app: Any = http.app
        record = app.state.context.ledger.get(job)
        assert (record.options, record.options_version) == (sent, OPTIONS_VERSION)


def test_a_request_repeated_with_its_defaults_written_out_is_the_same(
    tmp_path: Path, ball: MeshFile, rough_ball: MeshFile
) -> None:
    with (
        EmbeddedBroker(tmp_path) as broker,
        TestClient(an_app(broker, tmp_path), "http://127.0.0.1:8000") as http,
    ):
        answers = [
            http.post(
                "/v1/jobs",
                data={"options": options},
                files={"source": ("rough.obj", rough_ball.data), "reference": ("b.obj", ball.data)},
                headers={"Idempotency-Key": "one"},
            )
            for options in ("{}", '{"seed": 0, "cones": {}}', '{"seed": 1}')
        ]

    assert [answer.status_code for answer in answers] == [202, 202, 422]
    assert answers[0].json()["id"] == answers[1].json()["id"]


def an_app(broker: EmbeddedBroker, data_dir: Path) -> FastAPI:
    settings = ServiceSettings(redis_url=broker.url, data_dir=data_dir)
    return create_app(settings, keys_required=False)


def test_a_file_that_is_said_to_be_there_is_kept_as_if_it_had_been_sent(tmp_path: Path) -> None:
    digest = hashlib.sha256(b"mug").hexdigest()
    with (
        EmbeddedBroker(tmp_path) as broker,
        TestClient(an_app(broker, tmp_path), "http://127.0.0.1:8000") as http,
        connect_text(broker.url) as redis,
    ):
        http.put(f"/v1/blobs/{digest}", content=b"mug")
        [(lease, until)] = redis.zrange(BLOB_LEASES, 0, -1, withscores=True)
        redis.zadd(BLOB_LEASES, {lease: until - 80_000})  # as most of a day later

        assert http.head(f"/v1/blobs/{digest}").status_code == 200

        assert redis.zscore(BLOB_LEASES, lease) >= until
