from __future__ import annotations

import pytest

from tests.integration.jobs import make_job
from worker.jobs.errors import TransitionRefusedError, UnknownJobError
from worker.jobs.filters import JobFilter
from worker.jobs.identifiers import new_job_id
from worker.jobs.ledger import Ledger
from worker.jobs.records import Artifact, JobError, JobProgress, JobRecord

MESH = Artifact(digest="a" * 64, media_type="model/obj", filename="mug.refined.obj", size=3)
ERROR = JobError(kind="infeasible", message="the pins contradict the caps")
HALFWAY = JobProgress(stage="solve", round=2, rounds=5, fraction=0.5)


def test_a_created_job_reads_back_as_it_was(ledger: Ledger, queued_job: JobRecord) -> None:
    ledger.create(queued_job)

    assert ledger.get(queued_job.id) == queued_job


def test_a_job_runs_and_succeeds_with_what_it_made(ledger: Ledger, queued_job: JobRecord) -> None:
    ledger.create(queued_job)

    attempt = ledger.begin(queued_job.id)
    running = ledger.get(queued_job.id)
    ledger.succeed(queued_job.id, attempt, {"mesh": MESH})
    succeeded = ledger.get(queued_job.id)

    assert (running.state, running.attempt, running.finished) == ("running", 1, None)
    assert (succeeded.state, succeeded.artifacts) == ("succeeded", {"mesh": MESH})
    assert succeeded.started is not None
    assert succeeded.finished is not None
    assert queued_job.created <= succeeded.started <= succeeded.finished


def test_a_succeeded_job_is_done_in_full(ledger: Ledger, queued_job: JobRecord) -> None:
    ledger.create(queued_job)
    attempt = ledger.begin(queued_job.id)
    ledger.report_progress(queued_job.id, attempt, HALFWAY)

    ledger.succeed(queued_job.id, attempt, {"mesh": MESH})

    assert ledger.get(queued_job.id).progress == JobProgress(
        stage="done", round=5, rounds=5, fraction=1.0
    )


def test_a_succeeded_job_says_how_long_its_stages_took(
    ledger: Ledger, queued_job: JobRecord
) -> None:
    ledger.create(queued_job)

    ledger.succeed(queued_job.id, ledger.begin(queued_job.id), {}, timings={"solve": 1.5})

    assert ledger.get(queued_job.id).timings == {"solve": 1.5}


def test_a_failed_job_says_why(ledger: Ledger, queued_job: JobRecord) -> None:
    ledger.create(queued_job)

    ledger.fail(queued_job.id, ledger.begin(queued_job.id), ERROR)

    assert ledger.get(queued_job.id).state == "failed"
    assert ledger.get(queued_job.id).error == ERROR


def test_a_retried_job_is_queued_without_progress(ledger: Ledger, queued_job: JobRecord) -> None:
    ledger.create(queued_job)
    attempt = ledger.begin(queued_job.id)
    ledger.report_progress(queued_job.id, attempt, HALFWAY)

    ledger.retry(queued_job.id, attempt)

    queued = ledger.get(queued_job.id)
    assert (queued.state, queued.progress, queued.started) == ("queued", None, None)
    assert ledger.begin(queued_job.id) == 2


def test_progress_is_kept_while_running(ledger: Ledger, queued_job: JobRecord) -> None:
    ledger.create(queued_job)

    ledger.report_progress(queued_job.id, ledger.begin(queued_job.id), HALFWAY)

    assert ledger.get(queued_job.id).progress == HALFWAY


def test_a_running_job_cannot_be_begun_again(ledger: Ledger, queued_job: JobRecord) -> None:
    ledger.create(queued_job)
    ledger.begin(queued_job.id)

    with pytest.raises(TransitionRefusedError, match="is running at attempt 1"):
        ledger.begin(queued_job.id)


def test_a_queued_job_cannot_end(ledger: Ledger, queued_job: JobRecord) -> None:
    ledger.create(queued_job)

    with pytest.raises(TransitionRefusedError, match="is queued"):
        ledger.succeed(queued_job.id, 0, {"mesh": MESH})
    with pytest.raises(TransitionRefusedError, match="is queued"):
        ledger.fail(queued_job.id, 0, ERROR)


def test_an_ended_job_stays_as_it_is(ledger: Ledger, queued_job: JobRecord) -> None:
    ledger.create(queued_job)
    attempt = ledger.begin(queued_job.id)
    ledger.succeed(queued_job.id, attempt, {"mesh": MESH})

    with pytest.raises(TransitionRefusedError, match="is succeeded"):
        ledger.fail(queued_job.id, attempt, ERROR)
    with pytest.raises(TransitionRefusedError, match="is succeeded"):
        ledger.retry(queued_job.id, attempt)
    with pytest.raises(TransitionRefusedError, match="is succeeded"):
        ledger.report_progress(queued_job.id, attempt, HALFWAY)


def test_an_attempt_thought_dead_can_no_longer_speak(ledger: Ledger, queued_job: JobRecord) -> None:
    ledger.create(queued_job)
    presumed_dead = ledger.begin(queued_job.id)
    ledger.retry(queued_job.id, presumed_dead)
    ledger.begin(queued_job.id)

    with pytest.raises(TransitionRefusedError, match="is running at attempt 2"):
        ledger.report_progress(queued_job.id, presumed_dead, HALFWAY)
    with pytest.raises(TransitionRefusedError, match="is running at attempt 2"):
        ledger.succeed(queued_job.id, presumed_dead, {"mesh": MESH})


def test_an_id_is_taken_once(ledger: Ledger, queued_job: JobRecord) -> None:
    ledger.create(queued_job)

    with pytest.raises(TransitionRefusedError):
        ledger.create(queued_job)


def test_an_unknown_job_is_said_to_be_unknown(ledger: Ledger) -> None:
    with pytest.raises(UnknownJobError):
        ledger.get(new_job_id())
    with pytest.raises(UnknownJobError):
        ledger.begin(new_job_id())


def test_pages_go_from_newest_to_oldest_and_miss_nothing(ledger: Ledger) -> None:
    label = new_job_id()
    jobs = [make_job(label) for _ in range(5)]
    for job in jobs:
        ledger.create(job)

    wanted = JobFilter(labels=frozenset({label}))
    first = ledger.index.page(3, wanted=wanted)
    rest = ledger.index.page(3, wanted=wanted, cursor=first.cursor)

    newest_first = sorted((job.id for job in jobs), reverse=True)
    assert [job.id for job in first.jobs + rest.jobs] == newest_first


def test_a_page_can_be_of_one_state(ledger: Ledger) -> None:
    label = new_job_id()
    waiting, begun = make_job(label), make_job(label)
    for job in (waiting, begun):
        ledger.create(job)
    ledger.begin(begun.id)

    wanted = JobFilter(labels=frozenset({label}), state="running")
    page = ledger.index.page(10, wanted=wanted)

    assert [job.id for job in page.jobs] == [begun.id]
