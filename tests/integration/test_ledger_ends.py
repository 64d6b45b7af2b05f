"""The ways out of the ledger's usual course: canceled, handed back, expired, deleted."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import pytest

from worker.broker.connections import connect_text
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.errors import CancelRequestedError, TransitionRefusedError, UnknownJobError
from worker.jobs.identifiers import new_job_id
from worker.jobs.ledger import Ledger
from worker.jobs.records import Artifact, JobError, JobProgress, JobRecord, Output, RemoteFile

MESH = Artifact(digest="a" * 64, media_type="model/obj", filename="mug.refined.obj", size=3)
ERROR = JobError(kind="infeasible", message="the pins contradict the caps")
HALFWAY = JobProgress(stage="solve", round=2, rounds=5, fraction=0.5)


@pytest.fixture
def queued(ledger: Ledger, queued_job: JobRecord) -> str:
    ledger.create(queued_job)
    return queued_job.id


@pytest.fixture
def succeeded(ledger: Ledger, queued: str) -> str:
    ledger.succeed(queued, ledger.begin(queued), {"mesh": MESH})
    return queued


def test_a_queued_job_is_canceled_at_once(ledger: Ledger, queued: str) -> None:
    assert ledger.cancel(queued) == "canceled"

    record = ledger.get(queued)
    assert (record.state, record.attempt) == ("canceled", 0)
    assert record.finished is not None
    with pytest.raises(TransitionRefusedError, match="is canceled"):
        ledger.begin(queued)


@pytest.mark.parametrize("state", ["canceled", "failed"])
def test_a_job_that_ends_without_its_files_keeps_no_query_of_a_url(
    ledger: Ledger, queued_job: JobRecord, state: str
) -> None:
    def file(name: str) -> RemoteFile:
        return RemoteFile(name=name, url=f'https://example.org/{name}?token=3f9a?"3f9a"')

    output = Output(url="https://example.org/report?signature=3f9a")
    job = queued_job.model_copy(
        update={
            "source": file("mug.gltf"),
            "source_resources": (file("a.bin"), file("müg.bin")),
            "outputs": {"report": output},
            "progress": JobProgress.fetching(),
        }
    )
    ledger.create(job)

    if state == "canceled":
        ledger.cancel(job.id)
    else:
        ledger.fail_incomplete(job.id, ERROR)

    ended = ledger.get(job.id)
    assert (ended.state, ended.progress) == (state, None)
    assert "3f9a" not in ended.model_dump_json()
    assert ended.source == RemoteFile(name="mug.gltf", url="https://example.org/mug.gltf")
    assert [each.name for each in ended.source_resources] == ["a.bin", "müg.bin"]
    assert ended.reference == job.reference
    assert ended.outputs == {"report": Output(url="https://example.org/report")}


def test_a_job_that_fails_at_work_keeps_no_query_of_where_its_results_were_to_go(
    ledger: Ledger, queued_job: JobRecord
) -> None:
    output = Output(url="https://example.org/report?signature=3f9a")
    ledger.create(queued_job.model_copy(update={"outputs": {"report": output}}))
    attempt = ledger.begin(queued_job.id)
    assert ledger.get(queued_job.id).outputs["report"] == output

    ledger.fail(queued_job.id, attempt, ERROR)

    assert "3f9a" not in ledger.get(queued_job.id).model_dump_json()


def test_a_running_job_is_asked_to_stop_and_hears_it_when_it_reports(
    ledger: Ledger, queued: str
) -> None:
    attempt = ledger.begin(queued)

    assert ledger.cancel(queued) == "running"

    assert ledger.get(queued).cancel_requested
    with pytest.raises(CancelRequestedError):
        ledger.report_progress(queued, attempt, HALFWAY)
    ledger.end_canceled(queued, attempt)
    assert ledger.get(queued).state == "canceled"


def test_canceling_twice_changes_nothing(ledger: Ledger, queued: str) -> None:
    ledger.cancel(queued)
    once = ledger.get(queued)

    assert ledger.cancel(queued) == "canceled"
    assert ledger.get(queued) == once


@pytest.mark.parametrize("step", ["succeed", "fail", "retry", "hand_back"])
def test_a_job_asked_to_stop_ends_canceled_whatever_comes_of_its_attempt(
    ledger: Ledger, queued: str, step: str
) -> None:
    attempt = ledger.begin(queued)
    ledger.cancel(queued)
    arguments = {"succeed": [{"mesh": MESH}], "fail": [ERROR]}.get(step, [])

    state = getattr(ledger, step)(queued, attempt, *arguments)

    record = ledger.get(queued)
    assert state == record.state == "canceled"
    assert record.finished is not None
    assert (record.artifacts, record.error) == ({}, None)


def test_a_job_that_has_ended_cannot_be_canceled(ledger: Ledger, succeeded: str) -> None:
    with pytest.raises(TransitionRefusedError, match="is succeeded"):
        ledger.cancel(succeeded)


def test_an_attempt_handed_back_is_counted_as_no_fault(ledger: Ledger, queued: str) -> None:
    ledger.hand_back(queued, ledger.begin(queued))

    record = ledger.get(queued)
    assert (record.state, record.attempt, record.handed_back) == ("queued", 1, 1)
    assert ledger.begin(queued) == 2


def test_results_are_written_once(ledger: Ledger, succeeded: str) -> None:
    other = {"mesh": MESH.model_copy(update={"digest": "b" * 64})}

    with pytest.raises(TransitionRefusedError, match="is succeeded at attempt 1"):
        ledger.succeed(succeeded, 1, other)

    assert ledger.get(succeeded).artifacts == {"mesh": MESH}


@pytest.mark.parametrize("contested", ["begin", "succeed"])
def test_of_many_that_take_a_step_at_once_one_does(
    broker: EmbeddedBroker, ledger: Ledger, queued: str, contested: str
) -> None:
    attempt = None if contested == "begin" else ledger.begin(queued)

    def take(number: int) -> bool:
        mine = MESH.model_copy(update={"digest": f"{number:064x}"})
        with connect_text(broker.url) as client:
            try:
                if attempt is None:
                    Ledger(client).begin(queued)
                else:
                    Ledger(client).succeed(queued, attempt, {"mesh": mine})
            except TransitionRefusedError:
                return False
        return True

    with ThreadPoolExecutor(8) as pool:
        taken = list(pool.map(take, range(8)))

    record = ledger.get(queued)
    assert taken.count(True) == 1
    assert record.attempt == 1
    if contested == "succeed":
        assert record.artifacts["mesh"].digest == f"{taken.index(True):064x}"


def test_an_expired_job_keeps_its_record_but_says_so(ledger: Ledger, succeeded: str) -> None:
    ledger.expire(succeeded)
    once = ledger.get(succeeded)
    ledger.expire(succeeded)

    assert once.state == "succeeded"
    assert once.expired is not None
    assert ledger.get(succeeded) == once


@pytest.mark.parametrize("step", ["expire", "delete"])
def test_a_job_that_has_not_ended_neither_expires_nor_is_deleted(
    ledger: Ledger, queued: str, step: str
) -> None:
    with pytest.raises(TransitionRefusedError, match="is queued"):
        getattr(ledger, step)(queued)
    ledger.begin(queued)
    with pytest.raises(TransitionRefusedError, match="is running"):
        getattr(ledger, step)(queued)


def test_a_deleted_job_is_unknown(ledger: Ledger, succeeded: str) -> None:
    ledger.delete(succeeded)

    for step in (ledger.get, ledger.delete, ledger.cancel, ledger.expire):
        with pytest.raises(UnknownJobError):
            step(succeeded)


@pytest.mark.parametrize("step", ["cancel", "expire", "delete"])
def test_an_unknown_job_is_said_to_be_unknown(ledger: Ledger, step: str) -> None:
    with pytest.raises(UnknownJobError):
        getattr(ledger, step)(new_job_id())
