"""A job's events as server-sent events, and waiting for its end.

HTML Living Standard, section 9.2 (server-sent events).
"""

from __future__ import annotations

from collections.abc import AsyncGenerator, AsyncIterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated, Any

from fastapi import Depends, Header, Request, Response, status
from fastapi.sse import KEEPALIVE_COMMENT, format_sse_event
from redis.exceptions import RedisError

from service.api.routes.jobs import FoundJob
from service.api.routing import Absent, ResourceRouter
from service.api.schemas import JOBS_PATH
from service.api.streams import OpenStreams, events_response
from service.problems import ProblemError, problem
from worker.jobs.events import BEGINNING, EventFeed, is_event_id

if TYPE_CHECKING:
    from collections.abc import Iterator

router = ResourceRouter(prefix=JOBS_PATH, tags=["jobs"])

_RECONNECT = 1000  # milliseconds a client is asked to wait before it comes back
_EVENT = {
    "type": "object",
    "required": ["id", "event", "data"],
    "properties": {
        "id": {"type": "string"},
        "event": {"enum": ["state", "progress", "cancel"]},
        "data": {
            "type": "string",
            "contentMediaType": "application/json",
            "description": "{state, attempt}, {stage, round, rounds, fraction} or {attempt}",
        },
    },
}
_ANSWERS: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "the events; the stream ends with the job",
        "content": {"text/event-stream": {"itemSchema": _EVENT}},
    },
    204: {"description": "the job has ended, and its last event was the one named"},
}


class Events:
    """Follows jobs for the clients of one API process, up to a number of them at a time.

    Args:
        feed: the ledger's events.
        most: how many may follow at one time.

    Attributes:
        streams: what is being sent; closing it ends them all.
    """

    def __init__(self, feed: EventFeed, most: int) -> None:
        self.streams = OpenStreams()
        self._feed = feed
        self._most = most
        self._following = 0

    async def wait_for_end(self, job_id: str, seconds: float) -> bool:
        """Wait until a job has ended, or the time is up; false if no more clients may wait."""
        if self._following >= self._most:
            return False
        with self._one_more():
            await self._feed.wait_for_end(job_id, seconds)
        return True

    async def since(self, job_id: str, after: str) -> bool:
        """Whether anything has happened to a job after an event."""
        return bool(await self._feed.since(job_id, after))

    @contextmanager
    def place(self) -> Iterator[None]:
        """Count a client as long as it follows something, or refuse one too many.

        Raises:
            ProblemError: as many follow as may.
        """
        if self._following >= self._most:
            raise ProblemError(
                problem("unavailable", "too many clients follow jobs here; try again later"),
                {"Retry-After": "5"},
            )
        with self._one_more():
            yield

    async def stream(self, job_id: str, after: str) -> AsyncGenerator[bytes]:
        """The events after one, as they are sent."""
        yield format_sse_event(retry=_RECONNECT)
        try:
            async for event in self._feed.follow(job_id, after):
                if event is None:
                    yield KEEPALIVE_COMMENT
                else:
                    yield format_sse_event(id=event.id, event=event.name, data_str=event.data)
        except RedisError:
            return  # the client comes back with the last id it has seen

    @contextmanager
    def _one_more(self) -> Iterator[None]:
        self._following += 1
        try:
            yield
        finally:
            self._following -= 1


def _events(request: Request) -> Events:
    events: Events = request.app.state.events
    return events


EventsDependency = Annotated[Events, Depends(_events)]


async def _place(events: EventsDependency) -> AsyncIterator[None]:
    # Counted before the answer begins: a stream that is counted when its first part is asked
    # for leaves room for any number of requests that come at one time.
    with events.place():
        yield


PlaceDependency = Depends(_place)  # given up when the whole answer has been sent


@router.get(
    "/{job_id}/events",
    response_class=Response,
    responses=_ANSWERS,
    dependencies=[PlaceDependency],
    summary="Follow a job",
)
async def follow_job(
    request: Request,
    record: FoundJob,
    events: EventsDependency,
    last_event_id: Annotated[
        str | Absent, Header(description="the id of the last event received")
    ] = None,
) -> Response:
    """What has happened to a job and what happens, as server-sent events until it ends.

    After a connection is lost, `Last-Event-ID` has the events go on where they stopped.
    """
    if record.expired is not None:
        raise ProblemError(problem("gone", "the job's events have expired"))
    if last_event_id is not None and not is_event_id(last_event_id):
        raise ProblemError(problem("input", "header 'Last-Event-ID' is not from this service"))
    after = last_event_id or BEGINNING
    if record.has_ended and last_event_id and not await events.since(record.id, after):
        # The standard's way to tell a browser not to come back.
        return Response(status_code=status.HTTP_204_NO_CONTENT)
    following = events.streams.until_closed(events.stream(record.id, after))
    return events_response(request, following)
