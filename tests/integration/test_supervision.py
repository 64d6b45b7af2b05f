"""`meshcone serve` keeps its door open, whatever becomes of its processes."""

from __future__ import annotations

import os
import random
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest

from tests.calling import Caller, Form, small_form
from tests.integration.outcomes import times_succeeded
from tests.integration.waiting import wait_for
from tests.serving import Service, starting
from worker.broker.connections import connect_text
from worker.broker.embedded import running_broker_url

JOBS = 60
KILLS = 10
KILL_INTERVAL = 1.0  # seconds
SEED = 7
PATIENCE = 240.0  # seconds for sixty jobs; a guard, not an expectation


@pytest.fixture(scope="module")
def pair() -> Form:
    return small_form()


@pytest.mark.timeout(600)
def test_ten_kills_of_workers_in_ten_seconds_cost_no_request_and_no_job(
    tmp_path: Path, pair: Form
) -> None:
    with starting(tmp_path, "--workers", "2") as service, Caller(service.url()) as caller:
        killed: list[int] = []
        killer = threading.Thread(target=kill_workers, args=[service, killed])
        killer.start()
        while killer.is_alive() or len(caller.accepted) < JOBS:
            caller.look()
            if len(caller.accepted) < JOBS:
                caller.submit(pair)
            time.sleep(0.05)
        killer.join()
        wait_for(caller.has_seen_all_end, PATIENCE, pause=0.5)

        assert len(killed) == KILLS
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


def test_serve_ends_though_signals_come_while_it_handles_others(tmp_path: Path) -> None:
    with starting(tmp_path) as service:
        service.url()

        for number in (signal.SIGTERM, signal.SIGINT) * 200:
            service.process.send_signal(number)

        assert service.process.wait(PATIENCE) == 0


def test_settings_that_no_process_can_use_end_serve_with_the_reason(tmp_path: Path) -> None:
    with starting(tmp_path, MESHCONE_REQUIRE_KEYS="sometimes") as service:
        assert service.process.wait(PATIENCE) == 2

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


def kill_workers(service: Service, killed: list[int]) -> None:
    """Kill one each second, whether it works, waits or starts."""
    luck = random.Random(SEED)  # noqa: S311 - nothing secret
    while len(killed) < KILLS:
        workers = service.workers()
        if workers:
            killed.append(luck.choice(workers))
            with suppress(ProcessLookupError):
                os.kill(killed[-1], signal.SIGKILL)
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
