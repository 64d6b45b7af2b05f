"""What is written into the ledger about an attempt that could not do so itself."""

from __future__ import annotations

import os
import signal

import pytest

from tests.integration.jobs import make_job
from worker.jobs.errors import TransitionRefusedError
from worker.jobs.ledger import Ledger
from worker.jobs.records import JobRecord
from worker.run.attendance import Cause, Ending
from worker.run.horse import Death
from worker.run.settlement import DISK_FULL, settle

ATTEMPTS = 3
SEGFAULT = Ending(Cause.DIED, Death(None, signal.SIGSEGV))
KILLED = Ending(Cause.DIED, Death(None, signal.SIGKILL))


@pytest.fixture
def running_job(ledger: Ledger) -> JobRecord:
    record = make_job()
    ledger.create(record)
    ledger.begin(record.id)
    return ledger.get(record.id)


@pytest.fixture
def last_attempt(ledger: Ledger, running_job: JobRecord) -> JobRecord:
    for attempt in range(1, ATTEMPTS):
        ledger.retry(running_job.id, attempt)
        ledger.begin(running_job.id)
    return ledger.get(running_job.id)


def settled(
    ledger: Ledger, record: JobRecord, ending: Ending, *, was_out_of_memory: bool = False
) -> JobRecord:
    settle(ledger, record, ending, attempts=ATTEMPTS, was_out_of_memory=was_out_of_memory)
    return ledger.get(record.id)


def kind_of(record: JobRecord) -> str | None:
    return None if record.error is None else record.error.kind


@pytest.mark.parametrize("ending", [SEGFAULT, KILLED])
def test_a_job_whose_horse_crashed_is_queued_again(
    ledger: Ledger, running_job: JobRecord, ending: Ending
) -> None:
    assert settled(ledger, running_job, ending).state == "queued"


def test_a_crash_in_the_last_attempt_fails_the_job_and_names_the_signal(
    ledger: Ledger, last_attempt: JobRecord
) -> None:
    failed = settled(ledger, last_attempt, SEGFAULT)

    assert (failed.state, kind_of(failed)) == ("failed", "crash")
    assert failed.error is not None
    assert "SIGSEGV" in failed.error.message


def test_a_horse_the_system_ended_for_its_memory_fails_as_that(
    ledger: Ledger, last_attempt: JobRecord
) -> None:
    failed = settled(ledger, last_attempt, KILLED, was_out_of_memory=True)

    assert kind_of(failed) == "memory"


@pytest.mark.parametrize(
    "ending",
    [
        Ending(Cause.OVERTIME, Death(None, signal.SIGKILL)),
        Ending(Cause.DIED, Death(None, signal.SIGXCPU)),
    ],
)
def test_a_horse_over_its_time_is_a_timeout_at_once(
    ledger: Ledger, running_job: JobRecord, ending: Ending
) -> None:
    failed = settled(ledger, running_job, ending)

    assert (failed.state, failed.attempt, kind_of(failed)) == ("failed", 1, "timeout")


def test_a_worker_that_stops_burns_no_attempt(ledger: Ledger, last_attempt: JobRecord) -> None:
    stopped = Ending(Cause.STOPPED, Death(None, signal.SIGKILL))

    assert settled(ledger, last_attempt, stopped).state == "queued"

    ledger.begin(last_attempt.id)
    again = ledger.get(last_attempt.id)
    assert settled(ledger, again, SEGFAULT).state == "failed"


def test_a_job_whose_results_find_no_room_waits_and_burns_no_attempt(
    ledger: Ledger, last_attempt: JobRecord
) -> None:
    waiting = settled(ledger, last_attempt, Ending(Cause.DIED, Death(DISK_FULL, None)))

    assert (waiting.state, waiting.handed_back) == ("queued", 1)


def test_a_canceled_attempt_ends_as_canceled(ledger: Ledger, running_job: JobRecord) -> None:
    ledger.cancel(running_job.id)

    canceled = settled(ledger, running_job, Ending(Cause.CANCELED, KILLED.death))

    assert canceled.state == "canceled"


def test_an_attempt_that_lost_its_job_leaves_it_alone(
    ledger: Ledger, running_job: JobRecord
) -> None:
    ledger.retry(running_job.id, 1)
    ledger.begin(running_job.id)

    assert settled(ledger, running_job, Ending(Cause.LOST, KILLED.death)).attempt == 2
    with pytest.raises(TransitionRefusedError):
        settled(ledger, running_job, SEGFAULT)


def test_a_horse_that_has_told_the_ledger_itself_needs_no_step(
    ledger: Ledger, running_job: JobRecord
) -> None:
    well = Ending(Cause.DIED, Death(os.EX_OK, None))

    assert settled(ledger, running_job, well) == running_job


def test_a_broker_or_store_that_fails_is_worth_another_attempt(
    ledger: Ledger, running_job: JobRecord
) -> None:
    failing = Ending(Cause.DIED, Death(os.EX_TEMPFAIL, None))

    assert settled(ledger, running_job, failing).state == "queued"
