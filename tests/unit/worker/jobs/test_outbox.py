"""What a webhook tells."""

from __future__ import annotations

import json
from typing import Any

from worker.jobs.outbox import Message

ENDED = {
    "id": "7_succeeded_1",
    "job": "7",
    "state": "succeeded",
    "attempt": 1,
    "url": "https://ci.example.org/hook",
    "owner": None,
    "labels": '["nightly"]',
    "milliseconds": 1_800_000_000_000,
}


def told(**fields: Any) -> dict[str, Any]:
    body: dict[str, Any] = json.loads(Message.decoded(json.dumps({**ENDED, **fields})).body())
    return body


def test_the_end_of_a_job_says_how_it_ended_and_where_it_is() -> None:
    assert told() == {
        "type": "job.succeeded",
        "timestamp": "2027-01-15T08:00:00+00:00",
        "data": {
            "id": "7",
            "labels": ["nightly"],
            "state": "succeeded",
            "attempt": 1,
            "path": "/v1/jobs/7",
        },
    }


def test_the_end_of_a_batch_says_where_it_is() -> None:
    body = told(id="7_finished_0", state="finished", attempt=0, batch=True)

    assert body["type"] == "batch.finished"
    assert body["data"] == {"id": "7", "labels": ["nightly"], "path": "/v1/batches/7"}
