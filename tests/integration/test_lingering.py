"""An early answer reaches a client that reads only once it has sent everything."""

from __future__ import annotations

import socket
from urllib.parse import urlsplit

import anyio
import pytest
from starlette.types import Message, Receive, Scope, Send

from service.api.middleware.lingering import Lingering
from service.stack import Stack

LARGE = 20_000_000  # bytes; more than buffers on the way take


def exchange(url: str, head: str, body: bytes) -> bytes:
    """Send a request whole, and only then read the answer."""
    parts = urlsplit(url)
    with socket.create_connection((parts.hostname, parts.port), timeout=30) as connection:
        connection.sendall(head.encode() + body)
        answer = b""
        while received := connection.recv(65536):
            answer += received
    return answer


@pytest.mark.parametrize(
    ("content_type", "status"), [("text/plain", b"415"), ("multipart/form-data", b"400")]
)
def test_a_refusal_is_read_after_everything_was_sent(
    stack: Stack, content_type: str, status: bytes
) -> None:
    head = (
        "POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n"
        f"Content-Type: {content_type}\r\nContent-Length: {LARGE}\r\n\r\n"
    )

    answer = exchange(stack.url, head, bytes(LARGE))

    assert answer.split(b" ", 2)[1] == status
    assert b"application/problem+json" in answer


def test_who_asks_before_sending_is_told_not_to(stack: Stack) -> None:
    head = (
        "POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n"
        f"Expect: 100-continue\r\nContent-Type: text/plain\r\nContent-Length: {LARGE}\r\n\r\n"
    )

    answer = exchange(stack.url, head, b"")

    assert answer.startswith(b"HTTP/1.1 415")


def test_who_never_ends_is_not_waited_for_for_ever() -> None:
    async def app(_scope: Scope, _receive: Receive, send: Send) -> None:
        await send({"type": "http.response.start", "status": 413, "headers": []})
        await send({"type": "http.response.body", "body": b"no"})

    sent: list[Message] = []

    async def run() -> None:
        async def receive() -> Message:
            await anyio.sleep(0.01)
            return {"type": "http.request", "body": b"more", "more_body": True}

        async def send(message: Message) -> None:
            sent.append(message)

        scope = {"type": "http", "headers": [(b"transfer-encoding", b"chunked")]}
        with anyio.fail_after(60):
            await Lingering(app, seconds=0.1)(scope, receive, send)

    anyio.run(run)

    assert [message.get("more_body") for message in sent[1:]] == [True, False]
    assert sent[1]["body"] == b"no"
