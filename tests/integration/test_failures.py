"""What RQ's hooks write into the ledger."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

import pytest
from redis import Redis
from rq.exceptions import AbandonedJobError
from rq.job import Job
from rq.serializers import JSONSerializer

from tests.integration.jobs import make_job
from worker.failures import FailureRecorder
from worker.ledger import Ledger
from worker.records import JobRecord

ATTEMPTS = 3


@pytest.fixture
def recorder(ledger: Ledger) -> FailureRecorder:
    return FailureRecorder(ledger, ATTEMPTS)


@pytest.fixture
def running_job(ledger: Ledger) -> JobRecord:
    record = make_job()
    ledger.create(record)
    ledger.begin(record.id)
    return record


def rq_job(record: JobRecord) -> Job:
    job = Job.create(
        "worker.task.run",
        [record.id],
        connection=Redis(),  # never used
        serializer=JSONSerializer,
        id=record.id,
        timeout=60,
    )
    job.retries_left = ATTEMPTS
    job.started_at = datetime.now(UTC)
    return job


def test_an_unexpected_error_fails_the_job_without_its_details(
    recorder: FailureRecorder, ledger: Ledger, running_job: JobRecord
) -> None:
    job = rq_job(running_job)

    recorder.on_exception(job, KeyError, KeyError("/srv/secret"), None)

    failed = ledger.get(running_job.id)
    assert failed.error is not None
    assert (failed.state, failed.error.kind) == ("failed", "internal")
    assert "secret" not in failed.error.message
    assert not job.should_retry


def test_a_job_whose_worker_is_gone_is_queued_again(
    recorder: FailureRecorder, ledger: Ledger, running_job: JobRecord
) -> None:
    job = rq_job(running_job)

    recorder.on_exception(job, AbandonedJobError, AbandonedJobError(), None)

    assert ledger.get(running_job.id).state == "queued"
    assert job.should_retry


def test_the_last_attempt_is_not_followed_by_another(
    recorder: FailureRecorder, ledger: Ledger, running_job: JobRecord
) -> None:
    for attempt in range(1, ATTEMPTS):
        ledger.retry(running_job.id, attempt)
        ledger.begin(running_job.id)
    job = rq_job(running_job)

    recorder.on_killed_horse(job, 1, 9, None)

    assert ledger.get(running_job.id).state == "failed"
    assert not job.should_retry


def test_a_horse_killed_for_its_time_is_a_timeout(
    recorder: FailureRecorder, ledger: Ledger, running_job: JobRecord
) -> None:
    job = rq_job(running_job)
    job.started_at = datetime.now(UTC) - timedelta(seconds=125)

    recorder.on_killed_horse(job, 1, 9, None)

    failed = ledger.get(running_job.id)
    assert failed.error is not None
    assert failed.error.kind == "timeout"
    assert not job.should_retry


def test_a_job_that_died_before_it_began_is_left_to_the_queue(
    recorder: FailureRecorder, ledger: Ledger, queued_job: JobRecord
) -> None:
    ledger.create(queued_job)
    job = rq_job(queued_job)

    recorder.on_killed_horse(job, 1, 9, None)

    assert ledger.get(queued_job.id).state == "queued"
    assert job.should_retry


def test_a_job_the_ledger_does_not_know_is_not_tried_again(recorder: FailureRecorder) -> None:
    job = rq_job(make_job())

    recorder.on_killed_horse(job, 1, 9, None)

    assert not job.should_retry
