"""Finding jobs by state, label, verdict and age, and what is counted of them."""

from __future__ import annotations

from typing import cast

import pytest

from tests.integration.jobs import make_job
from worker.jobs.filters import JobFilter
from worker.jobs.identifiers import new_job_id
from worker.jobs.ledger import Ledger
from worker.jobs.records import JobError, JobRecord, StoredFile, Verdict


def listed(ledger: Ledger, wanted: JobFilter) -> list[str]:
    return [job.id for job in ledger.index.page(200, wanted=wanted).jobs]


def finish(ledger: Ledger, job: JobRecord, verdict: Verdict | None = None) -> None:
    ledger.create(job)
    ledger.succeed(job.id, ledger.begin(job.id), {}, verdict=verdict)


def test_a_job_is_found_under_all_its_labels(ledger: Ledger) -> None:
    one, other = new_job_id(), new_job_id()
    both = make_job(one).model_copy(update={"labels": (one, other)})
    first = make_job(one)
    for job in (both, first):
        ledger.create(job)

    assert listed(ledger, JobFilter(labels=frozenset({other}))) == [both.id]
    assert listed(ledger, JobFilter(labels=frozenset({one, other}))) == [both.id]
    assert set(listed(ledger, JobFilter(labels=frozenset({one})))) == {both.id, first.id}


def test_a_job_is_found_by_part_of_a_file_s_name_or_of_a_label(ledger: Ledger) -> None:
    mark = new_job_id()
    named = make_job().model_copy(
        update={"source": StoredFile(name=f"Mug {mark}.GLB", digest="d", size=1)}
    )
    labelled, other = make_job(f"for {mark}"), make_job()
    for job in (named, labelled, other):
        ledger.create(job)

    assert listed(ledger, JobFilter(name=f"mug {mark}.glb")) == [named.id]
    assert set(listed(ledger, JobFilter(name=mark.upper()))) == {named.id, labelled.id}
    assert listed(ledger, JobFilter(name=f"{mark}!")) == []


def test_a_job_is_found_by_what_its_gates_say(ledger: Ledger) -> None:
    passed, failed, ungated = make_job(), make_job(), make_job()
    finish(ledger, passed, "pass")
    finish(ledger, failed, "fail")
    finish(ledger, ungated)

    found = listed(ledger, JobFilter(verdict="fail"))

    assert failed.id in found
    assert not {passed.id, ungated.id} & set(found)


def test_failures_come_first_however_long_the_pages_are(ledger: Ledger) -> None:
    label = new_job_id()
    failed, passed, ungated, waiting, untested, fault, again = (make_job(label) for _ in range(7))
    for job, verdict in (
        (failed, "fail"), (passed, "pass"), (ungated, None), (untested, "not_tested"),
        (again, "fail"),
    ):  # fmt: skip
        finish(ledger, job, cast("Verdict | None", verdict))
    ledger.create(waiting)
    ledger.create(fault)
    ledger.fail(fault.id, ledger.begin(fault.id), JobError(kind="input", message="no mesh"))

    parts = ([failed, again], [fault], [untested], [waiting, ungated, passed])
    expected = [job_id for part in parts for job_id in sorted((j.id for j in part), reverse=True)]
    for size in range(1, 9):
        walked: list[str] = []
        cursor = None
        while True:
            page = ledger.index.failures_first(
                size, cursor=cursor, wanted=JobFilter(labels=frozenset({label}))
            )
            assert len(page.jobs) <= size
            walked += [job.id for job in page.jobs]
            cursor = page.cursor
            if cursor is None:
                break
        assert walked == expected


@pytest.mark.parametrize(
    ("wanted", "parts"),
    [
        (JobFilter(), [0, 1, 2, 3]),
        (JobFilter(verdict="pass"), [3]),
        (JobFilter(verdict="fail"), [0]),
        (JobFilter(state="failed"), [1]),
        (JobFilter(state="running"), [3]),
        (JobFilter(state="succeeded"), [0, 2, 3]),
    ],
)
def test_a_part_no_job_can_be_in_is_not_looked_for(wanted: JobFilter, parts: list[int]) -> None:
    assert [part for part, _ in wanted.troubles_first()] == parts


def test_jobs_are_tallied_by_state_and_verdict(ledger: Ledger) -> None:
    label, other = new_job_id(), new_job_id()
    both = make_job(label).model_copy(update={"labels": (label, other)})
    finish(ledger, make_job(label), "fail")
    finish(ledger, both, "pass")
    ledger.create(make_job(label))

    counted = ledger.index.tally(frozenset({label}))

    assert {name for name, count in counted.items() if count} == {
        "all", "queued", "succeeded", "fail", "pass",
    }  # fmt: skip
    assert (counted["all"], counted["succeeded"]) == (3, 2)
    assert ledger.index.tally(frozenset({label, other}))["all"] == 1
    assert ledger.index.tally()["all"] >= 3


def test_a_job_moves_from_one_state_to_the_other(ledger: Ledger, queued_job: JobRecord) -> None:
    ledger.create(queued_job)
    assert queued_job.id in listed(ledger, JobFilter(state="queued"))

    ledger.begin(queued_job.id)

    assert queued_job.id not in listed(ledger, JobFilter(state="queued"))
    assert queued_job.id in listed(ledger, JobFilter(state="running"))


def test_jobs_are_counted_by_state_and_the_oldest_known(
    ledger: Ledger, queued_job: JobRecord
) -> None:
    before = ledger.index.count("queued")

    ledger.create(queued_job)

    assert ledger.index.count("queued") == before + 1
    assert ledger.index.longest("queued") > 0


def test_jobs_long_in_a_state_are_found(ledger: Ledger, queued_job: JobRecord) -> None:
    ledger.create(queued_job)

    assert queued_job.id in ledger.index.in_state_for("queued", 0)
    assert queued_job.id not in ledger.index.in_state_for("queued", 3600)


def test_an_expired_job_waits_for_its_record_to_go(ledger: Ledger, queued_job: JobRecord) -> None:
    finish(ledger, queued_job)

    ledger.expire(queued_job.id)

    assert queued_job.id in ledger.index.in_state_for("expired", 0)
    assert queued_job.id not in ledger.index.in_state_for("succeeded", 0)
    assert queued_job.id in listed(ledger, JobFilter(state="succeeded"))


def test_a_deleted_job_is_in_no_index(ledger: Ledger) -> None:
    label = new_job_id()
    job = make_job(label)
    finish(ledger, job, "pass")

    ledger.delete(job.id)

    wanted = [
        JobFilter(),
        JobFilter(state="succeeded"),
        JobFilter(verdict="pass"),
        JobFilter(labels=frozenset({label})),
    ]
    assert not any(job.id in listed(ledger, each) for each in wanted)
    assert job.id not in ledger.index.in_state_for("succeeded", 0)


def test_steps_are_counted(ledger: Ledger, queued_job: JobRecord) -> None:
    before = ledger.index.counters()
    ledger.create(queued_job)
    ledger.fail(
        queued_job.id, ledger.begin(queued_job.id), JobError(kind="limit", message="too large")
    )

    after = ledger.index.counters()

    for name in ("transitions::queued", "transitions:running:failed", "failures:limit"):
        assert after[name] == before.get(name, 0) + 1
    assert after["seconds:queued"] > before.get("seconds:queued", 0)


def test_what_is_forgotten_is_counted_once(ledger: Ledger, queued_job: JobRecord) -> None:
    finish(ledger, queued_job)
    before = ledger.index.counters()

    ledger.expire(queued_job.id)
    ledger.expire(queued_job.id)
    ledger.delete(queued_job.id)

    after = ledger.index.counters()
    for name in ("expired", "deleted"):
        assert after[name] == before.get(name, 0) + 1
