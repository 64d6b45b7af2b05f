"""What API keys may use, counted by a real broker; and given back where nothing came of it."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from itertools import islice
from pathlib import Path
from typing import Any

import pytest
from redis import Redis
from starlette.testclient import TestClient

from meshcone.files import MeshFile
from service.access import quotas as quotas_module
from service.access.keys import ApiKey, KeyStore, Quota
from service.access.quotas import JobQuotas
from service.api.app import create_app
from service.problems import ProblemError
from service.settings import ServiceSettings
from tests.integration.jobs import make_job
from worker.broker.connections import connect_text
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.batches import Batches, BatchRecord
from worker.jobs.identifiers import ids_in_order, new_job_id
from worker.jobs.ledger import Ledger


@pytest.fixture
def store(redis: Redis) -> KeyStore:
    return KeyStore(redis)


@pytest.fixture
def quotas(redis: Redis) -> JobQuotas:
    return JobQuotas(redis, ServiceSettings())


def test_a_place_is_free_again_when_its_job_has_ended(
    store: KeyStore, quotas: JobQuotas, ledger: Ledger
) -> None:
    key = store.create("small", ["submit"], Quota(active_jobs=2)).key
    jobs = [make_job(), make_job()]
    for job in jobs:
        quotas.reserve(key, job.id, 1)
        ledger.create(job)
        quotas.settle(key, job.id, 1)

    with pytest.raises(ProblemError, match="2 jobs of this key") as refusal:
        quotas.reserve(key, new_job_id(), 1)
    ledger.cancel(jobs[0].id)
    quotas.reserve(key, new_job_id(), 1)

    assert refusal.value.problem.status == 429
    assert refusal.value.headers is not None
    assert int(refusal.value.headers["Retry-After"]) >= 1


def test_a_place_is_free_again_when_its_job_is_deleted(
    store: KeyStore, quotas: JobQuotas, ledger: Ledger
) -> None:
    key, job = store.create("small", ["submit"], Quota(active_jobs=1)).key, make_job()
    quotas.reserve(key, job.id, 1)
    ledger.create(job)
    quotas.settle(key, job.id, 1)

    ledger.cancel(job.id)
    ledger.delete(job.id)

    quotas.reserve(key, new_job_id(), 1)


def test_ended_jobs_of_a_key_without_a_limit_do_not_gather(
    store: KeyStore, quotas: JobQuotas, ledger: Ledger, redis: Redis
) -> None:
    key = store.create("any", ["submit"], Quota(active_jobs=0)).key
    for _ in range(3):
        job = make_job()
        quotas.reserve(key, job.id, 1)
        ledger.create(job)
        quotas.settle(key, job.id, 1)
        ledger.cancel(job.id)

    assert redis.zcard(f"meshcone:key:{key.id}:jobs") == 1


def test_a_reservation_from_before_the_clock_was_set_back_is_given_back(
    store: KeyStore, quotas: JobQuotas, redis: Redis
) -> None:
    key = store.create("small", ["submit"], Quota(active_jobs=1)).key
    dead = new_job_id()
    quotas.reserve(key, dead, 5)
    place = f"meshcone:key:{key.id}"
    size, day, since = str(redis.hget(f"{place}:reserved", dead)).split("/")
    redis.hset(f"{place}:reserved", dead, f"{size}/{day}/{int(since) + 7200}")
    redis.zincrby(f"{place}:jobs", 7200, dead)

    quotas.reserve(key, new_job_id(), 5)


def let_in(batches: Batches, quotas: JobQuotas, key: ApiKey, pairs: int) -> BatchRecord:
    """A batch of a key that is accepted; none of its jobs is entered yet."""
    batch = BatchRecord(
        id=new_job_id(), created=datetime.now(UTC), pairs=pairs, accounts=quotas.places(key)
    )
    jobs = islice(ids_in_order(), pairs)
    batches.stage(
        batch.id, [make_job().model_copy(update={"id": job, "batch": batch.id}) for job in jobs]
    )
    quotas.reserve(key, batch.id, 0, pairs)
    batches.commit(batch, capacity=1000)
    quotas.settle(key, batch.id, 0)
    return batch


def test_a_batch_counts_with_all_of_its_jobs_however_many_are_entered(
    store: KeyStore, quotas: JobQuotas, batches: Batches
) -> None:
    key = store.create("small", ["submit"], Quota(active_jobs=160)).key
    batch = let_in(batches, quotas, key, 150)

    for _ in range(3):  # none are entered, a hundred, all
        with pytest.raises(ProblemError, match="the batch has 11 jobs"):
            let_in(batches, quotas, key, 11)
        batches.carry_on(batch.id)

    let_in(batches, quotas, key, 10)


def test_the_places_of_a_batch_are_free_again_when_its_jobs_have_ended(
    store: KeyStore, quotas: JobQuotas, batches: Batches, ledger: Ledger
) -> None:
    key = store.create("small", ["submit"], Quota(active_jobs=1)).key
    batch = let_in(batches, quotas, key, 1)
    batches.carry_on(batch.id)

    [job_id] = batches.job_ids(batch.id)
    ledger.cancel(job_id)

    let_in(batches, quotas, key, 1)


def test_what_is_staged_of_a_batch_that_never_came_takes_no_place_when_it_has_gone(
    store: KeyStore, quotas: JobQuotas, batches: Batches, redis: Redis
) -> None:
    key, lost = store.create("small", ["submit"], Quota(active_jobs=1)).key, new_job_id()
    batches.stage(lost, [make_job()])
    quotas.reserve(key, lost, 0)  # and then its process died

    with pytest.raises(ProblemError):
        quotas.reserve(key, new_job_id(), 0)
    redis.delete(f"meshcone:batch:{lost}:entry")  # as when its time is over

    quotas.reserve(key, new_job_id(), 0)


def test_a_place_kept_for_a_job_that_never_came_is_not_lost(
    store: KeyStore, redis: Redis, quotas: JobQuotas
) -> None:
    key = store.create("unlucky", ["submit"], Quota(active_jobs=1)).key
    long_ago = datetime.now(UTC).timestamp() - 3600
    redis.zadd(f"meshcone:key:{key.id}:jobs", {new_job_id(): long_ago})

    quotas.reserve(key, new_job_id(), 1)


def test_bytes_are_counted_by_the_day(store: KeyStore, quotas: JobQuotas) -> None:
    key = store.create("small", ["submit"], Quota(daily_bytes=100)).key
    quotas.reserve(key, new_job_id(), 60)

    with pytest.raises(ProblemError, match="100 bytes this key may send a day") as refusal:
        quotas.reserve(key, new_job_id(), 60)
    quotas.reserve(key, new_job_id(), 40)

    assert refusal.value.headers is not None
    assert 0 < int(refusal.value.headers["Retry-After"]) <= 86_400


def used(redis: Redis, key: ApiKey) -> tuple[int, int]:
    """Jobs and bytes that are counted against a key."""
    counted = redis.get(f"meshcone:key:{key.id}:bytes")
    return redis.zcard(f"meshcone:key:{key.id}:jobs"), int(counted or 0)


def is_full(app: Any, _data_dir: Path) -> None:
    app.state.context.ledger.create(make_job())


def has_no_store(_app: Any, data_dir: Path) -> None:
    shutil.rmtree(data_dir / "blobs", ignore_errors=True)
    (data_dir / "blobs").write_text("a file where the folder was")


def has_no_ledger(app: Any, data_dir: Path) -> None:
    nobody = connect_text(f"unix://{data_dir}/nobody.sock")
    app.state.context = replace(app.state.context, ledger=Ledger(nobody))


@pytest.mark.parametrize("cannot", [is_full, has_no_store, has_no_ledger])
def test_what_a_refused_request_reserved_is_given_back(
    tmp_path: Path,
    ball: MeshFile,
    rough_ball: MeshFile,
    cannot: Callable[[Any, Path], None],
) -> None:
    with EmbeddedBroker(tmp_path) as broker, connect_text(broker.url) as redis:
        made = KeyStore(redis).create("unlucky", ["submit"])
        settings = ServiceSettings(redis_url=broker.url, data_dir=tmp_path, queue_capacity=1)
        with TestClient(create_app(settings), raise_server_exceptions=False) as http:
            cannot(http.app, tmp_path)

            answer = http.post(
                "/v1/jobs",
                headers={"Authorization": f"Bearer {made.token}"},
                data={"options": "{}"},
                files={"source": ("r.obj", rough_ball.data), "reference": ("b.obj", ball.data)},
            )

        assert answer.status_code >= 500
        assert used(redis, made.key) == (0, 0)


def test_what_an_accepted_request_reserved_stays_counted(
    store: KeyStore, redis: Redis, quotas: JobQuotas, ledger: Ledger
) -> None:
    key, job = store.create("lucky", ["submit"]).key, make_job()
    quotas.reserve(key, job.id, 60)
    ledger.create(job)

    for _ in range(2):  # a repetition changes nothing
        quotas.settle(key, job.id, 60)

    assert used(redis, key) == (1, 60)


def test_a_reservation_sent_twice_is_counted_once(
    store: KeyStore, redis: Redis, quotas: JobQuotas
) -> None:
    key, job = store.create("small", ["submit"], Quota(active_jobs=1)).key, new_job_id()

    for _ in range(2):  # as a client of the broker does whose connection broke
        quotas.reserve(key, job, 60)

    assert used(redis, key) == (1, 60)


def test_what_a_process_that_died_had_reserved_is_given_back_later(
    store: KeyStore,
    redis: Redis,
    quotas: JobQuotas,
    ledger: Ledger,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    key = store.create("unlucky", ["submit"], Quota(active_jobs=2, daily_bytes=100)).key
    accepted, lost, now = make_job(), new_job_id(), new_job_id()
    quotas.reserve(key, accepted.id, 30)
    ledger.create(accepted)  # and then its process died, too
    quotas.reserve(key, lost, 60)
    monkeypatch.setattr(quotas_module, "_SETTLING", -1)  # that time is over

    quotas.reserve(key, now, 65)

    assert used(redis, key) == (2, 95)


def test_a_request_slower_than_that_is_counted_when_its_job_is_known(
    store: KeyStore,
    redis: Redis,
    quotas: JobQuotas,
    ledger: Ledger,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    key, slow, other = store.create("slow", ["submit"]).key, make_job(), new_job_id()
    monkeypatch.setattr(quotas_module, "_SETTLING", -1)
    quotas.reserve(key, slow.id, 60)
    quotas.reserve(key, other, 5)
    assert used(redis, key) == (1, 5)

    ledger.create(slow)
    quotas.settle(key, slow.id, 60)
    quotas.settle(key, other, 5)

    assert used(redis, key) == (1, 60)


def test_bytes_of_yesterday_are_not_given_back_today(
    store: KeyStore, redis: Redis, quotas: JobQuotas
) -> None:
    key, yesterday, today = store.create("late", ["submit"]).key, new_job_id(), new_job_id()
    quotas.reserve(key, yesterday, 60)
    redis.delete(f"meshcone:key:{key.id}:bytes")  # as when its day is over
    redis.set(f"meshcone:key:{key.id}:bytes", 0, ex=40_000)
    quotas.reserve(key, today, 70)

    quotas.settle(key, yesterday, 60)

    assert used(redis, key) == (1, 70)
