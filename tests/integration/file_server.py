"""A server on this machine that has files, takes files, and can be as rude as a test wants."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler
from typing import ClassVar

from tests.listening import Silent, listening


@dataclass(frozen=True)
class Answer:
    """What a path is answered with.

    Attributes:
        length: the Content-Length to claim; by default the right one, none if negative.
        endless: whether the body is sent again and again until nobody listens.
        pause: seconds before each sending of the body.
        delay: seconds before anything is answered.
    """

    body: bytes = b""
    status: int = 200
    headers: Mapping[str, str] = field(default_factory=dict)
    length: int | None = None
    endless: bool = False
    pause: float = 0.0
    delay: float = 0.0


@dataclass(frozen=True)
class Seen:
    """A request that came."""

    method: str
    path: str
    headers: Mapping[str, str]
    body: bytes


@dataclass
class FileServer:
    """What is there, and what was asked for.

    Attributes:
        answers: by path, without the query; a list is worked through, and its last answer stays.
    """

    url: str = ""
    answers: dict[str, Answer | list[Answer]] = field(default_factory=dict)
    seen: list[Seen] = field(default_factory=list)

    def has(self, path: str, body: bytes, **more: object) -> str:
        """Have a file, and return its URL."""
        self.answers[path] = Answer(body, **more)  # type: ignore[arg-type]
        return self.url + path

    def answer_to(self, path: str) -> Answer:
        """The next answer of a path."""
        found = self.answers.get(path.partition("?")[0], Answer(status=404))
        if isinstance(found, Answer):
            return found
        return found.pop(0) if len(found) > 1 else found[0]

    def paths(self) -> list[str]:
        """The paths that were asked for, in order."""
        return [each.path for each in self.seen]


@contextmanager
def file_server() -> Iterator[FileServer]:
    """Listen on a free port of this machine while the body runs."""
    server = FileServer()

    class Handler(Silent, BaseHTTPRequestHandler):
        protocol_version: ClassVar[str] = "HTTP/1.1"

        def do_GET(self) -> None:
            self._answer(b"")

        def do_PUT(self) -> None:
            self._answer(self.rfile.read(int(self.headers["Content-Length"])))

        def _answer(self, body: bytes) -> None:
            headers = {name.lower(): value for name, value in self.headers.items()}
            server.seen.append(Seen(self.command, self.path, headers, body))
            answer = server.answer_to(self.path)
            time.sleep(answer.delay)
            self.send_response(answer.status)
            for name, value in answer.headers.items():
                self.send_header(name, value)
            length = len(answer.body) if answer.length is None else answer.length
            if length >= 0 and not answer.endless:
                self.send_header("Content-Length", str(length))
            self.send_header("Connection", "close")
            with suppress(OSError):  # nobody listens any more
                self.end_headers()
                _send(self.wfile.write, answer)
            self.close_connection = True

    with listening(Handler) as address:
        server.url = f"http://{address}"
        yield server


def _send(write: Callable[[bytes], object], answer: Answer) -> None:
    while True:
        time.sleep(answer.pause)
        write(answer.body)
        if not answer.endless:
            return
