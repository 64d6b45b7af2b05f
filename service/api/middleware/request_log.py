"""A line in the log for each request, and a name for it that goes with its job."""

from __future__ import annotations

import re
import secrets
import time
from typing import TYPE_CHECKING

import structlog
from starlette.datastructures import Headers, MutableHeaders

if TYPE_CHECKING:
    from starlette.types import ASGIApp, Message, Receive, Scope, Send

logger = structlog.get_logger(__name__)

HEADER = "X-Request-Id"
_ACCEPTABLE = re.compile(r"[\w.-]{8,128}", re.ASCII)
PROBES = frozenset({"/livez", "/readyz", "/metrics"})
"""Paths asked for every few seconds; that all was well is no news."""


class RequestLog:
    """ASGI middleware that names each request, says so in its answer, and writes it down.

    A name that the sender or a proxy has given it is kept if it is a harmless one.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        sent = Headers(scope=scope).get(HEADER, "")
        request_id = sent if _ACCEPTABLE.fullmatch(sent) else secrets.token_hex(16)
        status, started = 500, time.monotonic()

        async def send_with_name(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
                MutableHeaders(scope=message)[HEADER] = request_id
            await send(message)

        with structlog.contextvars.bound_contextvars(request_id=request_id):
            try:
                await self._app(scope, receive, send_with_name)
            finally:
                if status >= 400 or scope["path"] not in PROBES:
                    _write(scope, status, time.monotonic() - started)


def _write(scope: Scope, status: int, seconds: float) -> None:
    key = scope.get("state", {}).get("key")
    logger.info(
        "request",
        method=scope["method"],
        path=scope["path"],
        status=status,
        seconds=round(seconds, 4),
        key=None if key is None else key.id,
    )
