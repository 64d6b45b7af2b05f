"""Answers in JSON and text, compressed for those who accept that (RFC 9110, section 8.4)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from starlette.datastructures import Headers, MutableHeaders
from starlette_compress import CompressMiddleware, add_compress_type, remove_compress_type

from service.problems import MEDIA_TYPE

if TYPE_CHECKING:
    from starlette.types import ASGIApp, Message, Receive, Scope, Send

SMALLEST = 1000  # bytes; less would fit into one packet all the same

for _media_type in (MEDIA_TYPE, "text/csv"):
    add_compress_type(_media_type)
# An event is sent as it happens, whatever a client accepts.
remove_compress_type("text/event-stream")


class Compression:
    """ASGI middleware that compresses JSON and text with Brotli or gzip.

    Meshes, pictures, archives and parts of files are sent as they are. A compressed file has other
    bytes than the stored one, so its ETag becomes a weak one (section 8.8.1), and it is not offered
    in parts.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = CompressMiddleware(_AsForGet(app), minimum_size=SMALLEST, zstd=False)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on."""

        async def send_weakened(message: Message) -> None:
            if message["type"] == "http.response.start":
                _weaken(MutableHeaders(scope=message))
            elif message["type"] == "http.response.body" and _is_head(scope):
                message = {**message, "body": b""}
            await send(message)

        await self._app(scope, receive, send_weakened)


class _AsForGet:
    """ASGI wrapper that gives the answer to a HEAD some content, where it says how much it has.

    What compresses goes by what comes: without content it would leave out the headers that the
    answer to a GET has (RFC 9110, section 9.3.2).
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on."""
        has_content = False

        async def send_with_content(message: Message) -> None:
            nonlocal has_content
            if message["type"] == "http.response.start":
                has_content = Headers(raw=message["headers"]).get("content-length", "0") != "0"
            elif has_content and _is_empty_end(message):
                await send({**message, "body": b" ", "more_body": True})
            await send(message)

        await self._app(scope, receive, send_with_content if _is_head(scope) else send)


def _is_head(scope: Scope) -> bool:
    return bool(scope["type"] == "http" and scope["method"] == "HEAD")


def _is_empty_end(message: Message) -> bool:
    is_content = message["type"] == "http.response.body"
    return is_content and not message.get("body") and not message.get("more_body")


def _weaken(headers: MutableHeaders) -> None:
    if headers.get("content-encoding") not in ("br", "gzip"):
        return
    tag = headers.get("etag", "")
    if tag.startswith('"'):
        headers["etag"] = f"W/{tag}"
    if "accept-ranges" in headers:
        del headers["accept-ranges"]
