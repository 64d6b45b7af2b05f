"""Answers in JSON and text, compressed for those who accept that (RFC 9110, section 8.4)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from starlette.datastructures import MutableHeaders
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
        self._app = CompressMiddleware(app, minimum_size=SMALLEST, zstd=False)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on."""

        async def send_weakened(message: Message) -> None:
            if message["type"] == "http.response.start":
                _weaken(MutableHeaders(scope=message))
            await send(message)

        await self._app(scope, receive, send_weakened)


def _weaken(headers: MutableHeaders) -> None:
    if headers.get("content-encoding") not in ("br", "gzip"):
        return
    tag = headers.get("etag", "")
    if tag.startswith('"'):
        headers["etag"] = f"W/{tag}"
    if "accept-ranges" in headers:
        del headers["accept-ranges"]
