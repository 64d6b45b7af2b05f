"""`meshcone serve` keeps its door open, whatever becomes of its processes."""

from __future__ import annotations

import json
import os
import random
import signal
import threading
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Self

import httpx2
import pytest

from tests import shapes
from tests.integration.outcomes import times_succeeded
from tests.integration.waiting import wait_for
from tests.serving import Service, starting
from worker.broker.connections import connect_text
from worker.broker.embedded import running_broker_url

JOBS = 60
KILLS = 10
KILL_INTERVAL = 1.0  # seconds
SEED = 7
SMALL = json.dumps({"effort": "fast", "quality": {"samples": 256, "emd_samples": 32}})
RECOVERY = 90.0  # seconds for sixty jobs on a busy machine, after the longest pause


Form = dict[str, tuple[str, bytes]]


@pytest.fixture(scope="module")
def pair() -> Form:
    """A small pair, as the files of a form."""
    vertices, faces = shapes.sphere(1)
    return {
        "source": ("rough.obj", shapes.obj(shapes.noisy(vertices), faces)),
        "reference": ("ball.obj", shapes.obj(vertices, faces)),
    }


class Caller:
    """Somebody who asks once and takes what comes; every answer is noted.

    Attributes:
        alive: statuses of ``/livez``, with how often each came.
        statuses: those of all else.
        accepted: the ids of the jobs that were.
    """

    def __init__(self, url: str) -> None:
        self._http = httpx2.Client(base_url=url, timeout=60, trust_env=False)
        self.alive: Counter[int] = Counter()
        self.statuses: Counter[int] = Counter()
        self.accepted: list[str] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._http.close()

    def submit(self, pair: Form) -> httpx2.Response:
        answer = self._noted(self._http.post("/v1/jobs", files=pair, data={"options": SMALL}))
        if answer.status_code == 202:
            self.accepted.append(answer.json()["id"])
        return answer

    def look(self) -> None:
        """Ask for what answers at any time, and for what may say that something is missing."""
        self.alive[self._http.get("/livez").status_code] += 1
        self.readiness()
        self._noted(self._http.get("/v1/jobs"))

    def readiness(self) -> tuple[int, str]:
        answer = self._noted(self._http.get("/readyz"))
        return answer.status_code, answer.json().get("detail", "")

    def states(self) -> set[str]:
        """States of the accepted jobs."""
        answers = [self._noted(self._http.get(f"/v1/jobs/{each}")) for each in self.accepted]
        return {answer.json().get("state", "unknown just now") for answer in answers}

    def has_seen_all_end(self) -> bool:
        self.look()
        return self.states() <= {"succeeded", "failed", "canceled"}

    def _noted(self, answer: httpx2.Response) -> httpx2.Response:
        if answer.status_code == 503:
            assert answer.headers["content-type"] == "application/problem+json"
            assert "retry-after" in answer.headers
            assert answer.json()["detail"]
        self.statuses[answer.status_code] += 1
        return answer


def test_ten_kills_of_workers_in_ten_seconds_cost_no_request_and_no_job(
    tmp_path: Path, pair: Form
) -> None:
    with starting(tmp_path, "--workers", "2") as service, Caller(service.url()) as caller:
        killer = threading.Thread(target=kill_workers, args=[service])
        killer.start()
        while killer.is_alive() or len(caller.accepted) < JOBS:
            caller.look()
            if len(caller.accepted) < JOBS:
                caller.submit(pair)
            time.sleep(0.05)
        killer.join()
        wait_for(caller.has_seen_all_end, RECOVERY, pause=0.5)

        assert service.process.poll() is None
        assert set(caller.alive) == {200}
        assert set(caller.statuses) <= {200, 202, 503}
        with connect_text(running_broker_url(tmp_path / "meshcone-data")) as connection:
            assert {times_succeeded(connection, each) for each in caller.accepted} == {1}


def test_a_worker_killed_while_serve_starts_is_started_again(tmp_path: Path) -> None:
    with starting(tmp_path) as service:
        wait_for(lambda: bool(service.workers()))
        [worker] = service.workers()
        os.kill(worker, signal.SIGKILL)

        with Caller(service.url()) as caller:
            caller.look()

        assert service.workers() not in ([], [worker])
        assert caller.statuses == {200: 2}


def test_settings_that_no_process_can_use_end_serve_with_the_reason(tmp_path: Path) -> None:
    with starting(tmp_path, MESHCONE_REQUIRE_KEYS="sometimes") as service:
        assert service.process.wait(60) == 2

    told = service.log.read_text()
    assert "environment variable MESHCONE_REQUIRE_KEYS" in told
    assert "the API cannot run with these settings" in told.splitlines()[-1]


def test_without_a_worker_the_service_says_what_is_missing_and_takes_jobs(
    tmp_path: Path, pair: Form
) -> None:
    with starting(tmp_path) as service, Caller(service.url()) as caller:
        with stopped(*service.workers()):  # no more signs of life, and none to start again
            wait_for(lambda: caller.readiness() == (503, "no worker is running"))
            caller.submit(pair)
            assert caller.states() == {"queued"}

        wait_for(caller.has_seen_all_end)
        assert caller.states() == {"succeeded"}
        assert caller.readiness()[0] == 200


def kill_workers(service: Service) -> None:
    """Kill one each second, whether it works, waits or starts."""
    luck = random.Random(SEED)  # noqa: S311 - nothing secret
    for _ in range(KILLS):
        wait_for(lambda: bool(service.workers()))
        os.kill(luck.choice(service.workers()), signal.SIGKILL)
        time.sleep(KILL_INTERVAL)


@contextmanager
def stopped(*pids: int) -> Iterator[None]:
    """Processes that do nothing for a while."""
    for pid in pids:
        os.kill(pid, signal.SIGSTOP)
    try:
        yield
    finally:
        for pid in pids:
            os.kill(pid, signal.SIGCONT)
