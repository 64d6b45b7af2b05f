"""A cap on the size of a request, however it is declared or sent."""

from __future__ import annotations

from typing import TYPE_CHECKING

from starlette.datastructures import Headers

from meshcone.errors import LimitError
from service.problems import problem_of, problem_response

if TYPE_CHECKING:
    from starlette.types import ASGIApp, Message, Receive, Scope, Send


class BodyLimit:
    """ASGI middleware that refuses a request larger than ``limit`` bytes.

    The framework has a limit of its own, but answers it in plain text where a form is read.
    """

    def __init__(self, app: ASGIApp, limit: int) -> None:
        self._app = app
        self._limit = limit

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, counting its bytes."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        declared = Headers(scope=scope).get("content-length", "")
        if declared.isdecimal() and int(declared) > self._limit:
            response = problem_response(problem_of(self._error()), {"Connection": "close"})
            await response(scope, receive, send)
            return
        received = 0

        async def receive_within_limit() -> Message:
            nonlocal received
            message = await receive()
            received += len(message.get("body", b""))
            if received > self._limit:
                raise self._error()  # reaches the handlers through whoever reads the body
            return message

        await self._app(scope, receive_within_limit, send)

    def _error(self) -> LimitError:
        return LimitError(f"the request is larger than the {self._limit} bytes accepted here")
