"""The table of jobs as server-sent events, so that a page need not ask again and again."""

from __future__ import annotations

import time
from collections.abc import AsyncGenerator, Mapping
from typing import Annotated, Any

from fastapi import Depends, Query, Request, Response
from fastapi.sse import KEEPALIVE_COMMENT, format_sse_event
from pydantic import BaseModel

from service.api.context import Context, ContextDependency
from service.api.request_schemas import LABEL_LENGTH
from service.api.routes.batches import find_batch
from service.api.routes.events import EventsDependency, PlaceDependency
from service.api.routes.jobs import (
    CursorQuery,
    NameQuery,
    OrderQuery,
    cursor_after,
    position_of,
)
from service.api.routing import HeadRouter
from service.api.sender import SenderDependency
from service.api.streams import events_response
from service.dashboard.lists import SHOWN, LiveLists, Snapshot, UnavailableError
from service.dashboard.rows import Row, Rows
from worker.jobs.filters import JobFilter
from worker.jobs.index import Order
from worker.jobs.records import JobState, Verdict

router = HeadRouter(include_in_schema=False)

_KEEPALIVE = 15.0  # seconds after which silence is broken
_LONGEST = 300.0  # seconds; then the page comes back, to a server that may have been renewed


class _Change(BaseModel):
    """What a page has to know to show the list as it is now."""

    order: list[str]
    changed: list[dict[str, Any]]
    more: str | None
    counts: Mapping[str, int]


class _Rows(BaseModel):
    """A page of rows."""

    rows: list[dict[str, Any]]
    more: str | None


async def _live_lists(request: Request, context: ContextDependency) -> LiveLists:
    state = request.app.state
    if not hasattr(state, "live_lists"):
        state.live_lists = LiveLists(_table(context))
    lists: LiveLists = state.live_lists
    return lists


def _table(context: Context) -> Rows:
    return Rows(context.ledger.index, context.batches, context.settings.result_ttl)


def _wanted(
    context: ContextDependency,
    sender: SenderDependency,
    state: JobState | None = None,
    verdict: Verdict | None = None,
    label: Annotated[str | None, Query(max_length=LABEL_LENGTH)] = None,
    name: NameQuery = "",
    batch: str | None = None,
) -> JobFilter:
    """Which jobs are asked for.

    Raises:
        ProblemError: there is no such batch, or the sender may not know of it.
    """
    if batch is not None:
        find_batch(batch, context, sender)
    labels = frozenset({label}) if label else frozenset()
    return JobFilter(
        state=state, verdict=verdict, labels=labels, name=name, project=sender.view, batch=batch
    )


WantedDependency = Annotated[JobFilter, Depends(_wanted)]


@router.get("/dashboard/events", response_class=Response, dependencies=[PlaceDependency])
async def follow_jobs(
    request: Request,
    events: EventsDependency,
    lists: Annotated[LiveLists, Depends(_live_lists)],
    wanted: WantedDependency,
    order: OrderQuery = "newest",
) -> Response:
    """The first rows of the jobs that are wanted: all first, then those that have changed."""
    return events_response(request, events.streams.until_closed(_changes(lists, wanted, order)))


@router.get("/dashboard/rows")
def older_rows(
    context: ContextDependency,
    wanted: WantedDependency,
    order: OrderQuery = "newest",
    cursor: CursorQuery = None,
) -> _Rows:
    """The rows after a place."""
    page = _table(context).page(
        SHOWN, cursor=position_of(cursor, order), wanted=wanted, order=order
    )
    return _Rows(
        rows=[Row(entry).shown for entry in page.entries],
        more=page.cursor and cursor_after(page.cursor),
    )


async def _changes(lists: LiveLists, wanted: JobFilter, order: Order) -> AsyncGenerator[bytes]:
    end = time.monotonic() + _LONGEST
    seen: Snapshot | None = None
    snapshots = lists.follow(wanted, silence=_KEEPALIVE, order=order)
    try:
        async for snapshot in snapshots:
            if snapshot is None:
                yield KEEPALIVE_COMMENT
            else:
                rows = [row.shown for row in snapshot.changed_since(seen)]
                change = _Change(
                    order=list(snapshot.rows),
                    changed=rows,
                    more=snapshot.more and cursor_after(snapshot.more),
                    counts=snapshot.counts,
                )
                yield format_sse_event(event="jobs", data_str=change.model_dump_json())
                seen = snapshot
            if time.monotonic() > end:
                return
    except UnavailableError:
        yield format_sse_event(event="unavailable", data_str="{}")
    finally:
        await snapshots.aclose()
