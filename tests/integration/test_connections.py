"""Connections that send nothing, or half a request, and how many there may be."""

from __future__ import annotations

import os
import resource
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

import httpx2
import pytest

from service.api.listening.address import listen
from tests.integration.jobs import make_job
from tests.integration.waiting import wait_for
from worker.broker.embedded import EmbeddedBroker
from worker.jobs.ledger import Ledger

FILES = 160  # open files an API may have here
HALF = b"GET /livez HTTP/1.1\r\nHost: localhost\r\nX-Half:"
NEVER = "3600"  # seconds


@dataclass(frozen=True)
class Api:
    """A front end in a process of its own."""

    port: int
    log: Path

    def connect(self) -> socket.socket:
        return socket.create_connection(("127.0.0.1", self.port), timeout=30)

    def livez(self) -> int:
        url = f"http://127.0.0.1:{self.port}/livez"
        return httpx2.get(url, timeout=30, trust_env=False).status_code


@contextmanager
def running_api(broker: EmbeddedBroker, log: Path, **settings: str) -> Iterator[Api]:
    """An API that may open few files, asks for keys, and has some settings."""
    listener = listen("127.0.0.1", 0)
    command = [sys.executable, "-m", "service.cli", "api", "--fd", str(listener.fileno())]
    environment = {
        **os.environ,
        "MESHCONE_REDIS_URL": broker.url,
        "MESHCONE_DATA_DIR": str(log.parent),
        "MESHCONE_REQUIRE_KEYS": "always",
        **{f"MESHCONE_{name.upper()}": value for name, value in settings.items()},
    }
    with log.open("wb") as out:
        process = subprocess.Popen(
            command,
            env=environment,
            pass_fds=[listener.fileno()],
            stderr=out,
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (FILES, FILES)),
        )
    try:
        api = Api(listener.getsockname()[1], log)
        wait_for(lambda: is_up(api), 120)
        yield api
    finally:
        process.terminate()
        process.wait(240)
        listener.close()


def is_up(api: Api) -> bool:
    try:
        return api.livez() == 200
    except httpx2.TransportError:
        return False


@pytest.fixture(scope="module")
def patient(broker: EmbeddedBroker, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Api]:
    """One whose deadlines no test reaches."""
    log = tmp_path_factory.mktemp("patient") / "api.log"
    with running_api(broker, log, header_timeout=NEVER, body_timeout=NEVER) as api:
        yield api


@pytest.fixture(scope="module")
def strict(broker: EmbeddedBroker, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Api]:
    """One that waits a moment only."""
    log = tmp_path_factory.mktemp("strict") / "api.log"
    with running_api(
        broker, log, header_timeout="0.5", body_timeout="0.5", require_keys="auto"
    ) as api:
        yield api


def read_all(connection: socket.socket) -> bytes:
    """What a server sends until it closes."""
    received = b""
    try:
        while piece := connection.recv(65536):
            received += piece
    except ConnectionResetError:
        pass
    return received


def test_a_server_answers_however_many_send_half_a_header(patient: Api) -> None:
    with ExitStack() as held:
        for number in range(2 * FILES):
            held.enter_context(patient.connect()).sendall(HALF)
            if number % 40 == 0:
                assert patient.livez() == 200

        assert patient.livez() == 200

    assert len(patient.log.read_text().splitlines()) < FILES


def test_a_server_answers_however_many_send_nothing(patient: Api) -> None:
    with ExitStack() as held:
        for _ in range(2 * FILES):
            held.enter_context(patient.connect())

        assert patient.livez() == 200


def test_fewer_connections_than_wanted_are_announced(patient: Api) -> None:
    log = patient.log.read_text()

    assert "fewer connections than MESHCONE_MAX_CONNECTIONS" in log
    assert f"files={FILES}" in log or f'"files": {FILES}' in log


def test_half_a_header_is_refused_when_its_time_is_over(strict: Api) -> None:
    with strict.connect() as connection:
        connection.sendall(HALF)

        answer = read_all(connection)

    assert answer.startswith(b"HTTP/1.1 408 ")
    assert b"urn:meshcone:problem:slow-request" in answer


def test_a_connection_that_asks_nothing_is_closed(strict: Api) -> None:
    with strict.connect() as connection:
        assert read_all(connection) == b""


def test_half_a_header_after_an_answer_is_refused_too(strict: Api) -> None:
    with strict.connect() as connection:
        connection.sendall(b"GET /livez HTTP/1.1\r\nHost: localhost\r\n\r\n" + HALF)

        answer = read_all(connection)

    assert answer.startswith(b"HTTP/1.1 200 ")
    assert b"HTTP/1.1 408 " in answer


def test_a_body_that_stops_coming_is_refused(strict: Api) -> None:
    head = (
        "POST /v1/jobs HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000000\r\n"
        "Content-Type: multipart/form-data; boundary=x\r\n\r\n--x\r\n"
    )
    with strict.connect() as connection:
        connection.sendall(head.encode())

        answer = read_all(connection)

    assert answer.startswith(b"HTTP/1.1 408 ")
    assert b"body came too slowly" in answer


@pytest.mark.parametrize("target", ["POST /v1/jobs", f"PUT /v1/blobs/{'0' * 64}"])
def test_a_client_that_goes_within_its_body_is_no_fault_of_the_service(
    strict: Api, target: str
) -> None:
    path = target.partition(" ")[2]
    head = (
        f"{target} HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000000\r\n"
        "Content-Type: multipart/form-data; boundary=x\r\n\r\n--x\r\n"
    )
    with strict.connect() as connection:
        connection.sendall(head.encode())
        read_all(connection)

    wait_for(lambda: path in strict.log.read_text())  # the line of the request
    assert "Traceback" not in strict.log.read_text()


def test_what_is_no_http_is_refused_with_a_problem(patient: Api) -> None:
    with patient.connect() as connection:
        connection.sendall(b"\x16\x03\x01 hello\r\n\r\n")

        answer = read_all(connection)

    assert answer.startswith(b"HTTP/1.1 400 ")
    assert b"urn:meshcone:problem:bad-request" in answer


def test_too_few_files_for_any_connection_end_the_start_in_words(
    broker: EmbeddedBroker, tmp_path: Path
) -> None:
    ended = subprocess.run(
        [sys.executable, "-m", "service.cli", "api", "--port", "0"],
        env={**os.environ, "MESHCONE_REDIS_URL": broker.url, "MESHCONE_DATA_DIR": str(tmp_path)},
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (70, 70)),
        capture_output=True,
        timeout=120,
        check=False,
    )

    assert ended.returncode != 0
    assert b"raise the limit (ulimit -n" in ended.stderr


def test_event_streams_are_counted_and_leave_others_room(
    broker: EmbeddedBroker, ledger: Ledger, tmp_path: Path
) -> None:
    job = make_job()
    ledger.create(job)  # nobody works on it: its events have no end
    follow = f"GET /v1/jobs/{job.id}/events HTTP/1.1\r\nHost: localhost\r\n\r\n".encode()
    with (
        running_api(broker, tmp_path / "log", event_streams="2", require_keys="auto") as api,
        ExitStack() as held,
    ):
        answers = []
        for _ in range(3):
            connection = held.enter_context(api.connect())
            connection.sendall(follow)
            answers.append(connection.recv(12))

        assert answers == [b"HTTP/1.1 200", b"HTTP/1.1 200", b"HTTP/1.1 503"]
        assert api.livez() == 200
    ledger.cancel(job.id)
