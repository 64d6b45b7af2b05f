"""Answers that reach a client that is still sending.

A server that answers early, because a body is too large or its sender unknown, and closes
the connection has the network throw its answer away: what arrives at a closed connection is
met with a reset, and most clients read an answer only when they have sent everything. So
the rest is read, and dropped, for a while.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import anyio
from starlette.datastructures import Headers

if TYPE_CHECKING:
    from starlette.types import ASGIApp, Message, Receive, Scope, Send

LINGER = 20.0  # seconds


class Lingering:
    """ASGI middleware that keeps a connection open until its request has come in, or a time."""

    def __init__(self, app: ASGIApp, seconds: float = LINGER) -> None:
        self._app = app
        self._seconds = seconds

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on."""
        if scope["type"] != "http" or not _has_body(Headers(scope=scope)):
            await self._app(scope, receive, send)
            return
        body = _Body(receive, waits=Headers(scope=scope).get("expect") is not None)

        async def send_when_read(message: Message) -> None:
            is_last = message["type"] == "http.response.body" and not message.get("more_body")
            if not is_last or body.is_over:
                await send(message)
                return
            # The whole answer is on its way; only that it has ended is not said yet.
            await send({**message, "more_body": True})
            with anyio.move_on_after(self._seconds):
                await body.drop()
            await send({"type": "http.response.body", "body": b"", "more_body": False})

        await self._app(scope, body.receive, send_when_read)


class _Body:
    """What has come in of a request's body."""

    def __init__(self, receive: Receive, *, waits: bool) -> None:
        self._receive = receive
        # A client that waits for "100 Continue" (RFC 9110, section 10.1.1) sends nothing
        # unless somebody asks for the body, and reads the answer instead.
        self.is_over = waits

    async def receive(self) -> Message:
        """The next message, for the application."""
        message = await self._receive()
        self.is_over = message["type"] != "http.request" or not message.get("more_body", False)
        return message

    async def drop(self) -> None:
        """Read what is left."""
        while not self.is_over:
            await self.receive()


def _has_body(headers: Headers) -> bool:
    return "transfer-encoding" in headers or headers.get("content-length", "0") != "0"
