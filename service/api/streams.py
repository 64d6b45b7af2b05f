"""Answers without an end, which end with the server all the same."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator

from fastapi import Request, Response
from starlette.responses import StreamingResponse

_HEADERS = {"Cache-Control": "no-store", "X-Accel-Buffering": "no"}
_EVENTS = "text/event-stream"


def events_response(request: Request, events: AsyncGenerator[bytes]) -> Response:
    """Server-sent events as an answer; for HEAD its headers alone, at once."""
    if request.method == "HEAD":
        return Response(headers=_HEADERS, media_type=_EVENTS)
    return StreamingResponse(events, headers=_HEADERS, media_type=_EVENTS)


class OpenStreams:
    """Lets streams be sent until the server stops, and no second longer.

    A server that stops waits for the answers it has begun. One that goes on until something
    happens would have it wait for nothing, and be broken off with an error.
    """

    def __init__(self) -> None:
        self._closed = asyncio.Event()

    def close(self) -> None:
        """End all streams, and those that are still to come after what they have at once."""
        self._closed.set()

    async def until_closed(self, source: AsyncGenerator[bytes]) -> AsyncGenerator[bytes]:
        """What a source has to say until then."""
        closed = asyncio.ensure_future(self._closed.wait())
        coming: asyncio.Task[bytes | None] | None = None
        try:
            while True:
                coming = asyncio.create_task(_next_of(source))
                await asyncio.wait({coming, closed}, return_when=asyncio.FIRST_COMPLETED)
                if not coming.done() or (part := coming.result()) is None:
                    return
                yield part
        finally:
            closed.cancel()
            if coming is not None and not coming.done():
                coming.cancel()
                await asyncio.wait({coming})
            await source.aclose()


async def _next_of(source: AsyncGenerator[bytes]) -> bytes | None:
    return await anext(source, None)
