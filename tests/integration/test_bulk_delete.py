"""Deleting the jobs of a label, a page at a time."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient
from starlette.types import Message

from service.api.app import create_app
from service.settings import ServiceSettings
from tests.integration.jobs import make_job
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.identifiers import new_job_id
from worker.jobs.ledger import Ledger
from worker.jobs.records import JobRecord
from worker.storage.blobs import BlobStore

LOCAL = "http://127.0.0.1"


@pytest.fixture
def http(broker: EmbeddedBroker, tmp_path: Path) -> Iterator[TestClient]:
    settings = ServiceSettings(redis_url=broker.url, data_dir=tmp_path)
    with TestClient(create_app(settings, keys_required=False), LOCAL) as client:
        yield client


def entered(ledger: Ledger, *labels: str, ended: bool = True) -> JobRecord:
    job = make_job().model_copy(update={"labels": labels})
    ledger.create(job)
    if ended:
        ledger.cancel(job.id)
    return job


def delete(http: TestClient, **parameters: Any) -> dict[str, Any]:
    answer = http.delete("/v1/jobs", params=parameters)
    assert answer.status_code == 200, answer.text
    found: dict[str, Any] = answer.json()
    return found


def known(http: TestClient, *jobs: JobRecord) -> list[bool]:
    return [http.get(f"/v1/jobs/{job.id}").status_code == 200 for job in jobs]


def test_the_jobs_with_all_of_the_labels_go_and_no_other(ledger: Ledger, http: TestClient) -> None:
    night, old = new_job_id(), new_job_id()
    both, one = entered(ledger, night, old), entered(ledger, night)

    assert delete(http, label=[night, old]) == {"deleted": 1, "not_finished": 0, "next": None}
    assert known(http, both, one) == [False, True]


def test_a_job_that_has_not_ended_stays(ledger: Ledger, http: TestClient) -> None:
    label = new_job_id()
    waiting, ended = entered(ledger, label, ended=False), entered(ledger, label)

    assert delete(http, label=label) == {"deleted": 1, "not_finished": 1, "next": None}
    assert known(http, waiting, ended) == [True, False]


def test_many_go_page_by_page(ledger: Ledger, http: TestClient) -> None:
    label = new_job_id()
    jobs = [entered(ledger, label) for _ in range(5)]

    first = delete(http, label=label, limit=2)
    second = delete(http, label=label, limit=2, cursor=first["next"])
    last = delete(http, label=label, limit=2, cursor=second["next"])

    assert [page["deleted"] for page in (first, second, last)] == [2, 2, 1]
    assert last["next"] is None
    assert not any(known(http, *jobs))


def test_without_a_label_nothing_is_deleted(ledger: Ledger, http: TestClient) -> None:
    job = entered(ledger)

    assert http.delete("/v1/jobs").status_code == 422
    assert http.delete("/v1/jobs", params={"state": "canceled"}).status_code == 422
    assert known(http, job) == [True]


def test_the_files_of_a_deleted_job_are_removed_after_the_answer(
    ledger: Ledger, http: TestClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    job, label = entered(ledger, "one"), new_job_id()
    entered(ledger, label)
    done: list[str] = []
    remove = BlobStore.remove

    def removed(self: BlobStore, names: Collection[str]) -> None:
        done.append("removed")
        remove(self, names)

    async def ask(path: str, query: bytes) -> None:
        async def send(message: Message) -> None:
            if message["type"] == "http.response.body" and not message.get("more_body"):
                done.append("answered")

        async def receive() -> Message:
            return {"type": "http.request", "body": b"", "more_body": False}

        scope = {
            "type": "http",
            "asgi": {"version": "3.0"},
            "http_version": "1.1",
            "method": "DELETE",
            "scheme": "http",
            "path": path,
            "raw_path": path.encode(),
            "query_string": query,
            "headers": [(b"host", b"127.0.0.1")],
            "client": ("127.0.0.1", 1),
            "server": ("127.0.0.1", 80),
        }
        await http.app(scope, receive, send)

    monkeypatch.setattr(BlobStore, "remove", removed)
    assert http.portal is not None
    http.portal.call(ask, f"/v1/jobs/{job.id}", b"")
    http.portal.call(ask, "/v1/jobs", f"label={label}".encode())

    assert done == ["answered", "removed"] * 2
