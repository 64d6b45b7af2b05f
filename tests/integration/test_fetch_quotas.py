"""Bytes that are fetched count as those that are sent; given back if nothing came of them."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from redis import Redis
from starlette.testclient import TestClient

from meshcone.errors import LimitError
from service.access.keys import KeyStore, Quota
from service.api.app import create_app
from service.settings import ServiceSettings
from tests.integration.file_server import Answer, FileServer
from tests.integration.jobs import make_job
from tests.integration.transferring import transferring
from tests.integration.waiting import wait_for
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.fetch_accounts import ByteAccount, FetchAccounts
from worker.jobs.ledger import Ledger
from worker.jobs.records import JobProgress, JobRecord, RemoteFile

MUG = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
LIMIT = 2 * len(MUG) + 1
PLACE = "meshcone:key:tests:bytes"


@pytest.fixture
def broker(own_broker: EmbeddedBroker) -> EmbeddedBroker:
    """One for each test: its keys alone are counted."""
    return own_broker


@pytest.fixture
def settings(tmp_path: Path, broker: EmbeddedBroker) -> ServiceSettings:
    return ServiceSettings(data_dir=tmp_path, redis_url=broker.url, transfer_private_addresses=True)


@pytest.fixture
def http(settings: ServiceSettings) -> Iterator[TestClient]:
    with TestClient(create_app(settings), "http://127.0.0.1:8000") as client:
        yield client


def headers(redis: Redis, quota: Quota | None = None, project: str = "default") -> dict[str, str]:
    """Those of a key with that quota."""
    token = KeyStore(redis).create("a key", ["submit", "read"], quota, project).token
    return {"Authorization": f"Bearer {token}"}


def used(redis: Redis) -> int:
    """The bytes that count against the only key."""
    [place] = redis.keys("meshcone:key:*:bytes") or [""]
    return int(redis.get(place) or 0)


def audited(http: TestClient, url: str, key: dict[str, str]) -> str:
    """Submit the audit of a file elsewhere; the job's id."""
    document = {"source": {"url": url}, "options": {"mode": "audit"}}
    answer = http.post("/v1/jobs", json=document, headers=key)
    assert answer.status_code == 202, answer.text
    return str(answer.json()["id"])


def fetched(ledger: Ledger, job_id: str) -> JobRecord:
    """The job once its files are there, or it has failed for want of them."""
    wait_for(lambda: ledger.get(job_id).progress is None)
    return ledger.get(job_id)


def test_what_is_fetched_counts_with_what_is_sent_and_more_is_refused_before_it_is_stored(
    http: TestClient, redis: Redis, ledger: Ledger, settings: ServiceSettings, server: FileServer
) -> None:
    key, url = headers(redis, Quota(daily_bytes=LIMIT)), server.has("/mug.obj", MUG)
    other = server.has("/other.obj", MUG + b"#\n")
    form = {"files": {"source": ("mug.obj", MUG)}, "data": {"options": '{"mode": "audit"}'}}
    sent = http.post("/v1/jobs", **form, headers=key)
    assert sent.status_code == 202, sent.text

    with transferring(settings):
        within = fetched(ledger, audited(http, url, key))
        beyond = fetched(ledger, audited(http, other, key))

    assert (within.state, beyond.state) == ("queued", "failed")
    assert used(redis) == 2 * len(MUG)
    assert beyond.error is not None
    assert (beyond.error.kind, beyond.error.file) == ("limit", "other.obj")
    assert f"the {LIMIT} bytes that this key may send or have fetched a day" in beyond.error.message
    assert len([path for path in (settings.data_dir / "blobs").rglob("*") if path.is_file()]) == 1
    assert http.post("/v1/jobs", **form, headers=key).status_code == 429


def test_the_keys_of_a_project_share_what_it_may_have_fetched(
    settings: ServiceSettings, redis: Redis, ledger: Ledger, server: FileServer
) -> None:
    shared = settings.model_copy(update={"project_daily_bytes": LIMIT})
    keys = [headers(redis, project="lamps") for _ in range(3)] + [headers(redis, project="chairs")]
    url = server.has("/mug.obj", MUG)

    with (
        TestClient(create_app(shared), "http://127.0.0.1:8000") as http,
        transferring(settings),
    ):
        jobs = [fetched(ledger, audited(http, url, key)) for key in keys]

    assert [job.state for job in jobs] == ["queued", "queued", "failed", "queued"]
    assert jobs[2].error is not None
    assert "that this project may send" in jobs[2].error.message


def test_files_that_are_given_up_or_canceled_count_nothing(
    http: TestClient, redis: Redis, ledger: Ledger, settings: ServiceSettings, server: FileServer
) -> None:
    key, url = headers(redis, Quota(daily_bytes=LIMIT)), server.has("/mug.obj", MUG)
    nowhere = server.url + "/nowhere.obj"
    server.answers["/slow.obj"] = Answer(status=503)

    def with_reference(reference: str) -> str:
        document = {"source": {"url": url}, "reference": {"url": reference}}
        return str(http.post("/v1/jobs", json=document, headers=key).json()["id"])

    with transferring(settings, MESHCONE_FETCH_FIRST_DELAY="60"):
        failed = fetched(ledger, with_reference(nowhere))
        assert (failed.state, used(redis)) == ("failed", 0)
        waiting = with_reference(server.url + "/slow.obj")
        wait_for(lambda: used(redis) == len(MUG))
        ledger.cancel(waiting)

    assert used(redis) == 0


def incomplete_job(ledger: Ledger, **account: Any) -> JobRecord:
    record = make_job().model_copy(
        update={
            "source": RemoteFile(name="mug.obj", url="https://assets.example.org/mug.obj"),
            "reference": None,
            "progress": JobProgress.fetching(),
            "fetch_accounts": (ByteAccount(place=PLACE, whose="key", **account),),
        }
    )
    ledger.create(record)
    return record


def test_a_try_that_a_kill_has_cut_off_counts_once(ledger: Ledger, redis: Redis) -> None:
    accounts, job = FetchAccounts(redis), incomplete_job(ledger, limit=100)
    accounts.take(job.id, job.fetch_accounts, 60)  # then its process was killed

    accounts.give_back(job.id)  # as each try begins
    accounts.take(job.id, job.fetch_accounts, 40)
    accounts.take(job.id, job.fetch_accounts, 20)
    ledger.complete(make_job().model_copy(update={"id": job.id}))
    accounts.give_back(job.id)  # by a process that has come late

    assert int(redis.get(PLACE) or 0) == 60


def test_of_many_at_once_as_many_are_let_in_as_fit(ledger: Ledger, redis: Redis) -> None:
    accounts = FetchAccounts(redis)
    jobs = [incomplete_job(ledger, limit=100) for _ in range(40)]

    def takes(job: JobRecord) -> int:
        with suppress(LimitError):
            accounts.take(job.id, job.fetch_accounts, 30)
            return 1
        return 0

    with ThreadPoolExecutor(16) as several:
        assert sum(several.map(takes, jobs)) == 3
    for job in jobs:
        ledger.cancel(job.id)
    assert int(redis.get(PLACE) or 0) == 0
