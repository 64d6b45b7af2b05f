"""A server that receives webhooks, on this machine."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler

from tests.integration.waiting import wait_for
from tests.listening import Silent, listening


@dataclass
class Receiver:
    """What came in, and what is answered.

    Attributes:
        statuses: to answer with, one after the other; the last one for all that follow.
        location: where a redirect leads to.
    """

    statuses: list[int] = field(default_factory=lambda: [204])
    location: str = ""
    url: str = ""
    received: list[tuple[dict[str, str], bytes]] = field(default_factory=list)

    def status(self) -> int:
        """The next answer."""
        return self.statuses.pop(0) if len(self.statuses) > 1 else self.statuses[0]

    def wait_for(self, count: int) -> None:
        """Wait until so many requests have come."""
        wait_for(lambda: len(self.received) >= count)


@contextmanager
def receiving() -> Iterator[Receiver]:
    """Listen on a free port."""
    receiver = Receiver()

    class Handler(Silent, BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["Content-Length"]))
            receiver.received.append(({k.lower(): v for k, v in self.headers.items()}, body))
            self.send_response(receiver.status())
            if receiver.location:
                self.send_header("Location", receiver.location)
            self.send_header("Content-Length", "0")
            self.end_headers()

    with listening(Handler) as address:
        receiver.url = f"http://{address}/hook"
        yield receiver
