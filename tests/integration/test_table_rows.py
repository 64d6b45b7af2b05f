"""The table of jobs: batches among the jobs that belong to none."""

from __future__ import annotations

from datetime import UTC, datetime
from itertools import islice

import pytest
from redis import Redis

from service.dashboard.rows import Rows
from tests.integration.jobs import make_job
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.batches import Batches, BatchRecord
from worker.jobs.filters import EVERYTHING, JobFilter
from worker.jobs.identifiers import ids_in_order, new_job_id
from worker.jobs.ledger import Ledger


@pytest.fixture
def broker(own_broker: EmbeddedBroker) -> EmbeddedBroker:
    """One for each test: its rows alone are in the table."""
    return own_broker


@pytest.fixture
def table(redis: Redis, ledger: Ledger) -> Rows:
    return Rows(ledger.index, Batches(redis), 0)


def a_job(ledger: Ledger, **fields: object) -> str:
    return ledger.create(make_job().model_copy(update=fields))


def a_batch(
    batches: Batches, pairs: int = 3, of_jobs: tuple[str, ...] = (), **fields: object
) -> str:
    """A batch with that many jobs, all entered; ``of_jobs`` are labels that only they have."""
    record = BatchRecord(id=new_job_id(), created=datetime.now(UTC), pairs=pairs)
    record = record.model_copy(update=fields)
    common = {"batch": record.id, "project": record.project, "labels": record.labels + of_jobs}
    jobs = [
        make_job().model_copy(update={"id": job_id, **common})
        for job_id in islice(ids_in_order(), pairs)
    ]
    batches.stage(record.id, jobs)
    batches.commit(record, capacity=1000)
    while batches.carry_on(record.id)[1]:
        pass
    return record.id


def walked(table: Rows, limit: int, wanted: JobFilter = EVERYTHING) -> list[str]:
    """All rows, page by page."""
    cursor, found = None, []
    for _ in range(100):
        page = table.page(limit, cursor=cursor, wanted=wanted)
        assert len(page.entries) <= limit
        found += [entry.id for entry in page.entries]
        cursor = page.cursor
        if cursor is None:
            return found
    raise AssertionError("the pages do not end")


@pytest.mark.parametrize("limit", [1, 2, 3, 50])
def test_every_page_goes_on_where_the_last_one_ended(
    table: Rows, ledger: Ledger, limit: int
) -> None:
    sent = []
    for number in range(9):
        is_batch = number in (1, 2, 3, 7)
        sent.append(a_batch(table.batches) if is_batch else a_job(ledger))

    assert walked(table, limit) == sorted(sent, reverse=True)


def test_a_batch_is_listed_where_one_of_its_jobs_is_wanted(table: Rows, ledger: Ledger) -> None:
    night, other = a_batch(table.batches, labels=("night",)), a_batch(table.batches)
    glass = a_batch(table.batches, of_jobs=("glass",))
    [job, *_] = table.batches.job_ids(other)
    ledger.succeed(job, ledger.begin(job), {}, verdict="fail")

    assert walked(table, 50, JobFilter(labels=frozenset({"night"}))) == [night]
    assert walked(table, 50, JobFilter(labels=frozenset({"glass"}))) == [glass]
    assert walked(table, 50, JobFilter(verdict="fail")) == [other]
    assert walked(table, 50, JobFilter(state="canceled")) == []


def test_a_search_and_a_look_into_a_batch_list_jobs(table: Rows, ledger: Ledger) -> None:
    batch, alone = a_batch(table.batches), a_job(ledger)
    jobs = sorted(table.batches.job_ids(batch), reverse=True)

    assert sorted(walked(table, 50, JobFilter(name="mug"))) == sorted([alone, *jobs])
    assert walked(table, 2, JobFilter(batch=batch)) == jobs
    assert table.tally(JobFilter(batch=batch))["queued"] == len(jobs)


def test_a_project_sees_its_own_batches(table: Rows) -> None:
    chairs, lamps = (
        a_batch(table.batches, project="chairs"),
        a_batch(table.batches, project="lamps"),
    )

    assert walked(table, 50, JobFilter(project="chairs")) == [chairs]
    assert walked(table, 50) == sorted([chairs, lamps], reverse=True)


def test_jobs_of_a_version_without_this_table_are_put_into_it(
    table: Rows, ledger: Ledger, redis: Redis
) -> None:
    batch, alone = a_batch(table.batches), a_job(ledger)
    for key in redis.keys("meshcone:*alone:*"):
        redis.delete(key)
    assert walked(table, 50) == [batch]

    for _ in range(3):
        ledger.index.place_by_project(2)

    assert walked(table, 50) == sorted([alone, batch], reverse=True)


def test_a_deleted_job_is_in_the_table_no_more(table: Rows, ledger: Ledger) -> None:
    job = a_job(ledger)
    ledger.cancel(job)
    assert walked(table, 50, JobFilter(state="canceled")) == [job]

    ledger.delete(job)

    assert walked(table, 50) == []
