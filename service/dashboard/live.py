"""The list of jobs as server-sent events, so that a page need not ask again and again."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncGenerator, AsyncIterator
from typing import Annotated, Any

from fastapi import APIRouter, Query
from fastapi.concurrency import run_in_threadpool
from fastapi.sse import KEEPALIVE_COMMENT, format_sse_event
from pydantic import BaseModel
from redis.exceptions import RedisError
from starlette.responses import StreamingResponse

from service.api.context import Context, ContextDependency
from service.api.routes.events import Events, EventsDependency
from service.api.schemas import LABEL_LENGTH, Job
from worker.jobs.index import JobFilter
from worker.jobs.records import JobState, Verdict

router = APIRouter(include_in_schema=False)

SHOWN = 50  # jobs, the newest
_INTERVAL = 1.0  # seconds between looks
_KEEPALIVE = 15.0  # seconds after which silence is broken
_LONGEST = 300.0  # seconds; then the page comes back, to a server that may have been renewed


# What a row of the table is made of: a seventh of a job, of which the options are the most.
_ROW: dict[str, Any] = {
    **dict.fromkeys(("id", "state", "labels", "created", "progress", "verdict"), True),
    "source": {"name"},
    "reference": {"name"},
    "options": {"mode"},
    "error": {"detail"},
    "summary": {
        "outcome": True,
        "radius": True,
        "worst": True,
        "metrics": {"point_to_surface.max"},
    },
}


class _Change(BaseModel):
    """What a page has to know to show the list as it is now."""

    order: list[str]
    changed: list[dict[str, Any]]
    more: str | None


@router.get("/dashboard/events", response_class=StreamingResponse)
async def follow_jobs(
    context: ContextDependency,
    events: EventsDependency,
    state: JobState | None = None,
    verdict: Verdict | None = None,
    label: Annotated[str | None, Query(max_length=LABEL_LENGTH)] = None,
) -> StreamingResponse:
    """The newest jobs that are wanted: all of them first, then those that have changed."""
    events.require_room()
    labels = frozenset({label}) if label else frozenset()
    wanted = JobFilter(state=state, verdict=verdict, labels=labels)
    changes = events.streams.until_closed(_followed(context, events, wanted))
    headers = {"Cache-Control": "no-store", "X-Accel-Buffering": "no"}
    return StreamingResponse(changes, headers=headers, media_type="text/event-stream")


async def _followed(context: Context, events: Events, wanted: JobFilter) -> AsyncGenerator[bytes]:
    with events.one_more():
        async for change in _changes(context, wanted):
            yield change


async def _changes(context: Context, wanted: JobFilter) -> AsyncIterator[bytes]:
    seen: dict[str, Job] = {}
    silent_since: float | None = None
    end = time.monotonic() + _LONGEST
    while time.monotonic() < end:
        try:
            page = await run_in_threadpool(context.ledger.index.page, SHOWN, wanted=wanted)
        except RedisError:
            yield format_sse_event(event="unavailable", data_str="{}")
            return
        now = {record.id: context.job(record) for record in page.jobs}
        changed = [job for job_id, job in now.items() if seen.get(job_id) != job]
        if changed or now.keys() != seen.keys() or silent_since is None:
            rows = [job.model_dump(mode="json", include=_ROW) for job in changed]
            change = _Change(order=list(now), changed=rows, more=page.cursor)
            yield format_sse_event(event="jobs", data_str=change.model_dump_json())
            seen, silent_since = now, time.monotonic()
        elif time.monotonic() - silent_since > _KEEPALIVE:
            yield KEEPALIVE_COMMENT
            silent_since = time.monotonic()
        await asyncio.sleep(_INTERVAL)
