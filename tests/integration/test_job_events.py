"""Events are written by transitions, and by nothing else."""

from __future__ import annotations

import asyncio
import json
import threading
from collections.abc import Coroutine
from typing import Any, TypeVar

import pytest

from service.api.routes.events import Events
from service.problems import ProblemError
from worker.broker.connections import connect_async
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.events import BEGINNING, EventFeed, JobEvent
from worker.jobs.identifiers import new_job_id
from worker.jobs.ledger import Ledger
from worker.jobs.records import JobProgress, JobRecord
from worker.jobs.step_scripts import EVENTS_KEPT

Found = TypeVar("Found")


def progress(fraction: float) -> JobProgress:
    return JobProgress(stage="solve", round=1, rounds=5, fraction=fraction)


async def read(url: str, job_id: str, after: str, seconds: float) -> list[JobEvent]:
    async with connect_async(url) as client:
        feed = EventFeed(client)
        return [event async for event in feed.follow(job_id, after, seconds=seconds) if event]


def run(work: Coroutine[Any, Any, Found]) -> Found:
    return asyncio.run(work)


def follow(
    broker: EmbeddedBroker, job_id: str, after: str = BEGINNING, seconds: float = 60.0
) -> list[JobEvent]:
    return run(read(broker.url, job_id, after, seconds))


def test_every_step_of_a_job_is_an_event(
    broker: EmbeddedBroker, ledger: Ledger, queued_job: JobRecord
) -> None:
    ledger.create(queued_job)
    ledger.retry(queued_job.id, ledger.begin(queued_job.id))
    attempt = ledger.begin(queued_job.id)
    ledger.report_progress(queued_job.id, attempt, progress(0.5))
    ledger.cancel(queued_job.id)
    ledger.end_canceled(queued_job.id, attempt)

    events = follow(broker, queued_job.id)

    assert [(each.name, json.loads(each.data)) for each in events] == [
        ("state", {"state": "queued", "attempt": 0}),
        ("state", {"state": "running", "attempt": 1}),
        ("state", {"state": "queued", "attempt": 1}),
        ("state", {"state": "running", "attempt": 2}),
        ("progress", {"stage": "solve", "round": 1, "rounds": 5, "fraction": 0.5}),
        ("cancel", {"attempt": 2}),
        ("state", {"state": "canceled", "attempt": 2}),
    ]


def test_a_refused_step_is_no_event(
    broker: EmbeddedBroker, ledger: Ledger, queued_job: JobRecord
) -> None:
    ledger.create(queued_job)
    ledger.cancel(queued_job.id)
    ledger.cancel(queued_job.id)

    assert [each.name for each in follow(broker, queued_job.id)] == ["state", "state"]


def test_events_come_as_they_happen(
    broker: EmbeddedBroker, ledger: Ledger, queued_job: JobRecord
) -> None:
    ledger.create(queued_job)
    later = threading.Timer(0.2, ledger.cancel, [queued_job.id])

    later.start()
    events = follow(broker, queued_job.id)

    assert [json.loads(each.data)["state"] for each in events] == ["queued", "canceled"]
    later.join()  # it may not have its own answer yet


def test_they_go_on_after_any_of_them(
    broker: EmbeddedBroker, ledger: Ledger, queued_job: JobRecord
) -> None:
    ledger.create(queued_job)
    ledger.cancel(queued_job.id)
    first, last = follow(broker, queued_job.id)

    assert follow(broker, queued_job.id, first.id) == [last]


def test_following_ends_in_time_where_nothing_happens(
    broker: EmbeddedBroker, ledger: Ledger, queued_job: JobRecord
) -> None:
    ledger.create(queued_job)

    assert len(follow(broker, queued_job.id, seconds=0.3)) == 1


def test_following_what_is_not_there_ends(broker: EmbeddedBroker) -> None:
    assert follow(broker, new_job_id(), seconds=0.3) == []


def test_a_talkative_job_keeps_its_last_events(
    broker: EmbeddedBroker, ledger: Ledger, queued_job: JobRecord
) -> None:
    ledger.create(queued_job)
    attempt = ledger.begin(queued_job.id)
    for step in range(EVENTS_KEPT + 10):
        ledger.report_progress(queued_job.id, attempt, progress(step / 1000))
    ledger.succeed(queued_job.id, attempt, {})

    events = follow(broker, queued_job.id)

    assert len(events) == EVENTS_KEPT
    assert events[-1].is_last


def test_no_more_clients_follow_than_may(
    broker: EmbeddedBroker, ledger: Ledger, queued_job: JobRecord
) -> None:
    ledger.create(queued_job)

    async def scenario() -> None:
        async with connect_async(broker.url) as client:
            events = Events(EventFeed(client), most=1)
            with events.place():
                with pytest.raises(ProblemError) as refusal, events.place():
                    pass
                assert refusal.value.problem.status == 503
                assert not await events.wait_for_end(queued_job.id, 5)
            with events.place():
                pass

    run(scenario())
