"""One connection, whose request has to come in time.

uvicorn waits for ever for the rest of a header or a body. Whoever sends half a header, and
needs no key for that, would keep a connection, and with a thousand of them everybody else out.
"""

from __future__ import annotations

from enum import Enum, auto
from http import HTTPStatus
from typing import TYPE_CHECKING, Any, Protocol

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol

from service.problems import MEDIA_TYPE, SECURITY_HEADERS, Problem, problem

if TYPE_CHECKING:
    import asyncio

    from service.settings import ServiceSettings

SEND_TIMEOUT = 60.0  # seconds in which a client has to take something of its answer


class Phase(Enum):
    """What a connection waits for."""

    IDLE = auto()
    """The next request, of which nothing has come."""
    HEADER = auto()
    """The rest of a header; on a new connection, all of it."""
    BODY = auto()
    """The rest of a body."""
    ANSWER = auto()
    """The application."""


class Watch(Protocol):
    """Who is told what a connection does."""

    def waits(self, connection: BoundedProtocol) -> None:
        """It has no request in hand."""

    def works(self, connection: BoundedProtocol) -> None:
        """It has a request in hand."""

    def ended(self, connection: BoundedProtocol) -> None:
        """It is closed."""

    def was_slow(self, phase: Phase) -> None:
        """It was given up: nothing came, or too little."""


class BoundedProtocol(H11Protocol):
    """uvicorn's protocol, with deadlines for what the client sends and takes.

    Time counts only while the connection waits for the client: not while the application
    lags behind, nor while the client waits for "100 Continue".

    Args:
        settings: the deadlines.
        watch: told of its phases.
        uvicorn: what uvicorn's own protocol takes.
    """

    def __init__(self, settings: ServiceSettings, watch: Watch, **uvicorn: Any) -> None:
        super().__init__(**uvicorn)
        self._watch = watch
        self._limits = {Phase.HEADER: settings.header_timeout, Phase.BODY: settings.body_timeout}
        self._rate = settings.body_rate
        self._phase = Phase.HEADER
        self._patience = settings.header_timeout
        self._unsent = 0  # bytes, at the last look
        self._stuck = 0.0  # seconds

    @property
    def is_answered(self) -> bool:
        """Whether its client has been answered, and has not sent all of its request."""
        return self._phase is Phase.BODY and bool(self.cycle.response_started)

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin to wait for a header."""
        super().connection_made(transport)
        self._watch.waits(self)

    def connection_lost(self, exc: Exception | None) -> None:
        """Be gone."""
        super().connection_lost(exc)
        self._watch.ended(self)

    def data_received(self, data: bytes) -> None:
        """Take what has come, and time with it."""
        if self._phase is Phase.IDLE:
            self._enter(Phase.HEADER)
        super().data_received(data)
        self._enter(self._found_phase(has_begun=True))
        if self._phase is Phase.BODY:
            earned = self._patience + len(data) / self._rate
            self._patience = min(earned, self._limits[Phase.BODY])

    def on_response_complete(self) -> None:
        """Wait for the next request, of which some may be here."""
        super().on_response_complete()
        rest, _ = self.conn.trailing_data
        has_begun = bool(rest) or self.conn.their_state is h11.SEND_BODY
        self._enter(self._found_phase(has_begun=has_begun))

    def send_400_response(self, msg: str) -> None:
        """Refuse what is not HTTP."""
        self._refuse(problem("bad-request", msg.rstrip(".").lower()))

    def look(self, seconds: float) -> None:
        """Give up if the client has not done its part, the given time after the last look."""
        if self._takes_nothing(seconds):
            self.transport.abort()
        elif not self.transport.is_closing() and self._is_clients_turn():
            self._patience -= seconds
            if self._patience <= 0:
                self._give_up()

    def _enter(self, phase: Phase) -> None:
        if phase is self._phase:
            return
        self._phase = phase
        self._patience = self._limits.get(phase, 0.0)
        if phase in (Phase.IDLE, Phase.HEADER):
            self._watch.waits(self)
        else:
            self._watch.works(self)

    def _found_phase(self, *, has_begun: bool) -> Phase:
        if self.cycle is not None and not self.cycle.response_complete:
            return Phase.BODY if self.conn.their_state is h11.SEND_BODY else Phase.ANSWER
        return Phase.HEADER if has_begun else Phase.IDLE  # or what is left of a body, unwanted

    def _is_clients_turn(self) -> bool:
        if self._phase is Phase.HEADER:
            return True
        return (
            self._phase is Phase.BODY
            and not self.flow.read_paused
            and not self.conn.they_are_waiting_for_100_continue
        )

    def _takes_nothing(self, seconds: float) -> bool:
        unsent = self.transport.get_write_buffer_size()
        self._stuck = self._stuck + seconds if unsent and unsent == self._unsent else 0.0
        self._unsent = unsent
        return self._stuck > SEND_TIMEOUT

    def _give_up(self) -> None:
        self._watch.was_slow(self._phase)
        if self._phase is Phase.HEADER and self.conn.trailing_data[0] == b"":
            self.transport.close()  # nothing was asked, so nothing is answered
            return
        part, limit = self._phase.name.lower(), self._limits[self._phase]
        detail = f"the request's {part} came too slowly"
        if self._phase is Phase.HEADER:
            detail += f": it has to be here within {limit:g} s"
        else:
            detail += f": fewer than {self._rate} bytes a second, for {limit:g} s"
        self._refuse(problem("slow-request", detail))

    def _refuse(self, answer: Problem) -> None:
        """Answer with a problem, unless an answer has begun, and close."""
        if self.cycle is not None and not self.cycle.response_complete:
            has_begun = self.cycle.response_started
            self.cycle.disconnected = True  # the application is to say nothing after this
            self.cycle.message_event.set()
            if has_begun:
                self.transport.abort()
                return
        self.transport.write(raw_answer(answer))
        self.transport.close()


def raw_answer(answer: Problem) -> bytes:
    """A problem as the bytes of a whole answer, after which the connection is closed."""
    body = answer.model_dump_json(exclude_none=True).encode()
    headers = {
        "content-type": MEDIA_TYPE,
        "content-length": str(len(body)),
        "connection": "close",
        **SECURITY_HEADERS,
    }
    lines = [f"HTTP/1.1 {answer.status} {HTTPStatus(answer.status).phrase}"]
    lines += [f"{name}: {value}" for name, value in headers.items()]
    return "\r\n".join([*lines, "", ""]).encode() + body
