"""All connections of an API process: accepted up to a number, and looked at every second."""

from __future__ import annotations

import asyncio
import socket
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING

import structlog

from service.api.listening.protocol import BoundedProtocol, Phase, raw_answer
from service.problems import problem

if TYPE_CHECKING:
    from service.settings import ServiceSettings

logger = structlog.get_logger(__name__)

BACKLOG = 2048  # connections the kernel keeps until they are accepted
_LONGEST_TICK = 1.0  # seconds between two looks
_TICKS_PER_TIMEOUT = 4
_ACCEPT_PAUSE = 0.2  # seconds, where the system is out of files
_QUIET = 60.0  # seconds between two log lines on the same trouble


class Connections:
    """The open connections, and which of them have no request in hand.

    If as many are held as may be, the one that has waited longest without a request makes
    room: a client that sends its header at once is served however many send half of one.

    Args:
        settings: how many there may be, and their deadlines.
    """

    def __init__(self, settings: ServiceSettings) -> None:
        self._most = settings.max_connections
        self._all: set[BoundedProtocol] = set()
        self._waiting: dict[BoundedProtocol, None] = {}  # the longest first
        self._troubles = _Troubles()
        shortest = min(settings.header_timeout, settings.body_timeout)
        self._tick = min(_LONGEST_TICK, shortest / _TICKS_PER_TIMEOUT)

    def waits(self, connection: BoundedProtocol) -> None:
        """Note that a connection has no request in hand."""
        self._all.add(connection)
        self._waiting.pop(connection, None)
        self._waiting[connection] = None

    def works(self, connection: BoundedProtocol) -> None:
        """Note that a connection has a request in hand."""
        self._waiting.pop(connection, None)

    def ended(self, connection: BoundedProtocol) -> None:
        """Note that a connection is closed."""
        self._all.discard(connection)
        self._waiting.pop(connection, None)

    def was_slow(self, phase: Phase) -> None:
        """Note that a connection was given up."""
        self._troubles.note(f"slow_{phase.name.lower()}")

    async def watch(self) -> None:
        """Look at every connection, again and again."""
        looked = time.monotonic()
        while True:
            await asyncio.sleep(self._tick)
            now = time.monotonic()
            # A process that was stopped, or busy, has not read what its clients have sent.
            seconds, looked = min(now - looked, 2 * self._tick), now
            for connection in list(self._all):
                connection.look(seconds)
            self._troubles.report()

    async def accept(self, listener: socket.socket, build: Callable[[], BoundedProtocol]) -> None:
        """Take in connections, for ever.

        asyncio's own server tries 2,048 times, with a log line each, when the system is out
        of files.
        """
        loop = asyncio.get_running_loop()
        listener.setblocking(False)
        listener.listen(BACKLOG)
        while True:
            try:
                connection, _ = await loop.sock_accept(listener)
            except ConnectionError:
                continue  # its client has gone
            except OSError as error:
                self._troubles.note("not_accepted", error.strerror)
                self._make_room()
                await asyncio.sleep(_ACCEPT_PAUSE)
                continue
            await self._take_in(connection, build)

    async def _take_in(
        self, connection: socket.socket, build: Callable[[], BoundedProtocol]
    ) -> None:
        if len(self._all) >= self._most and not self._make_room():
            self._troubles.note("turned_away")
            with connection, suppress(OSError):
                connection.send(_FULL)
            return
        await asyncio.sleep(0)  # the one that made room is closed now
        try:
            await asyncio.get_running_loop().connect_accepted_socket(build, connection)
        except OSError:  # its client has gone
            connection.close()

    def _make_room(self) -> bool:
        answered = (each for each in self._all if each.is_answered)
        given_up = next(iter(self._waiting), None) or next(answered, None)
        if given_up is None:
            return False
        self._troubles.note("made_room")
        self.ended(given_up)
        given_up.transport.abort()
        return True


class _Troubles:
    """What happened to connections, as a log line a minute at most."""

    def __init__(self) -> None:
        self._counts: Counter[str] = Counter()
        self._reason: str | None = None
        self._said = float("-inf")

    def note(self, what: str, reason: str | None = None) -> None:
        self._counts[what] += 1
        self._reason = reason or self._reason

    def report(self) -> None:
        if self._counts and time.monotonic() - self._said >= _QUIET:
            logger.warning("connections closed by the server", **self._counts, reason=self._reason)
            self._counts.clear()
            self._reason, self._said = None, time.monotonic()


_FULL = raw_answer(problem("unavailable", "this server has as many connections as it allows"))
