"""Jobs of versions without projects: the default project has them, their files too."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import pytest
from redis import Redis

from meshcone.errors import InputError
from meshcone.files import MeshFile
from service.access.keys import ApiKey, KeyStore
from tests.integration.jobs import stored_job
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.filters import JobFilter
from worker.jobs.identifiers import new_job_id
from worker.jobs.ledger import Ledger
from worker.jobs.ledger_keys import job_keys
from worker.jobs.records import JobRecord, Verdict
from worker.storage.blobs import BlobStore
from worker.storage.local import Directory
from worker.storage.register import BlobRegister

DEFAULT = "default"


@pytest.fixture
def broker(own_broker: EmbeddedBroker) -> EmbeddedBroker:
    """What a test does to all jobs it does to no other test's."""
    return own_broker


@pytest.fixture
def register(redis: Redis) -> BlobRegister:
    return BlobRegister(redis)


@pytest.fixture
def older(redis: Redis, ledger: Ledger, register: BlobRegister, tmp_path: Path) -> JobRecord:
    """A job as a version without projects leaves it."""
    blobs = BlobStore(Directory(tmp_path / "blobs"), register)
    job = stored_job(blobs, MeshFile("mug.obj", new_job_id().encode()), labels=("night",))
    ledger.create(job)
    without_projects(redis, job.id)
    return job


def without_projects(redis: Redis, job_id: str) -> None:
    """Leave a job as a version without projects does."""
    redis.hdel(job_keys(job_id)[0], "project")
    for key in redis.keys("meshcone:project*"):
        redis.delete(key)


def listed(ledger: Ledger, **wanted: object) -> list[str]:
    page = ledger.index.page(200, wanted=JobFilter(**wanted))  # type: ignore[arg-type]
    return [job.id for job in page.jobs]


def test_a_look_at_all_jobs_puts_them_into_the_default_project(
    ledger: Ledger, register: BlobRegister, older: JobRecord
) -> None:
    assert listed(ledger, project=DEFAULT) == []

    while ledger.index.place_by_project(1):
        pass

    for wanted in ({}, {"labels": frozenset({"night"})}, {"state": "queued"}):
        assert listed(ledger, project=DEFAULT, **wanted) == [older.id]
    assert listed(ledger, project="other") == []
    assert ledger.index.count("queued", DEFAULT) == 1
    assert register.is_had(older.source.digest, DEFAULT)
    assert not register.is_had(older.source.digest, "other")


@pytest.mark.parametrize("verdict", ["pass", None])
def test_one_that_has_succeeded_is_found_there_by_what_its_gates_say(
    redis: Redis, ledger: Ledger, older: JobRecord, verdict: Verdict | None
) -> None:
    ledger.succeed(older.id, ledger.begin(older.id), {}, verdict=verdict)
    without_projects(redis, older.id)

    ledger.index.place_by_project(10)

    assert listed(ledger, project=DEFAULT, state="succeeded") == [older.id]
    expected = [] if verdict is None else [older.id]
    assert listed(ledger, project=DEFAULT, verdict="pass") == expected


def test_a_step_of_such_a_job_puts_it_there_too(
    ledger: Ledger, register: BlobRegister, older: JobRecord
) -> None:
    ledger.begin(older.id)

    assert listed(ledger, project=DEFAULT, state="running") == [older.id]
    assert register.is_had(older.source.digest, DEFAULT)


def test_its_files_go_with_it_however_often_it_is_looked_at(
    ledger: Ledger, register: BlobRegister, older: JobRecord
) -> None:
    for _ in range(3):
        ledger.index.place_by_project(10)
    ledger.cancel(older.id)
    ledger.delete(older.id)

    assert not register.is_had(older.source.digest, DEFAULT)
    assert listed(ledger, project=DEFAULT) == []


def test_a_job_that_an_older_worker_has_moved_is_found_where_it_is_now(
    redis: Redis, ledger: Ledger, older: JobRecord
) -> None:
    ledger.index.place_by_project(10)
    # As a version without projects moves it.
    redis.hset(job_keys(older.id)[0], "state", "canceled")
    redis.zrem("meshcone:since:queued", older.id)
    redis.zadd("meshcone:since:canceled", {older.id: 1.0})

    ledger.index.place_by_project(10)

    assert listed(ledger, project=DEFAULT, state="canceled") == [older.id]
    assert (ledger.index.count("queued", DEFAULT), ledger.index.count("canceled", DEFAULT)) == (
        0,
        1,
    )


def test_its_owner_is_told_before_anything_is_put_anywhere(
    ledger: Ledger, older: JobRecord
) -> None:
    assert ledger.index.project_of(older.id) == DEFAULT
    assert ledger.get(older.id).project == DEFAULT
    assert ledger.index.project_of(new_job_id()) is None


def test_what_a_project_has_uploaded_is_its_own_for_as_long_as_it_is_kept(
    register: BlobRegister,
) -> None:
    register.lease_upload("a" * 64, "lamps", 60)
    register.lease_upload("b" * 64, "lamps", -1)

    assert register.is_had("a" * 64, "lamps")
    assert not register.is_had("a" * 64, "chairs")
    assert not register.is_had("b" * 64, "lamps")  # its time is over


def test_a_key_made_before_there_were_projects_is_of_the_default_one() -> None:
    made = ApiKey(id="1", name="ci", scopes=("read",), created=datetime.now(UTC), digest="d")

    known = ApiKey.model_validate(made.model_dump(exclude={"project"}))

    assert known.view == DEFAULT


@pytest.mark.parametrize("name", ["", "Lamps", "a:b", "-a", "a-", "a/b", "ä", "a" * 64, "a b"])
def test_a_name_that_no_project_can_have_is_refused(redis: Redis, name: str) -> None:
    with pytest.raises(InputError, match="a project's name"):
        KeyStore(redis).create("ci", ["read"], project=name)
