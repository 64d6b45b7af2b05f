"""A forked process: how it ends, and what it may do."""

from __future__ import annotations

import os
import resource
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.integration.waiting import wait_for
from tests.processes import has_ended
from worker.run.horse import Death, Horse
from worker.run.sandbox import confine
from worker.settings import WorkerSettings


def run(work: Callable[[], int]) -> Death:
    horse = Horse.start(work)
    death = horse.wait(20)
    assert death is not None
    return death


def confined(work: Callable[[], int], **settings: int) -> Death:
    """How a horse ends that works under the installation's limits."""
    installation = WorkerSettings(redis_url="unix:///nowhere.sock", **settings)

    def horse() -> int:
        confine(installation)
        return work()

    return run(horse)


def test_its_exit_code_is_what_its_work_returned() -> None:
    assert run(lambda: 7) == Death(7, None)


def test_what_escapes_its_work_is_an_exit_code_too() -> None:
    def stumble() -> int:
        raise ZeroDivisionError

    assert run(stumble) == Death(os.EX_SOFTWARE, None)


def test_what_killed_it_is_named() -> None:
    def crash() -> int:
        os.kill(os.getpid(), signal.SIGKILL)
        return 0

    assert run(crash) == Death(None, signal.SIGKILL)


def test_killing_it_takes_what_it_started_with_it(tmp_path: Path) -> None:
    started = tmp_path / "pid"

    def work() -> int:
        child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)"])
        started.with_suffix(".part").write_text(str(child.pid))
        started.with_suffix(".part").rename(started)
        time.sleep(60)
        return 0

    horse = Horse.start(work)
    wait_for(started.exists)

    assert horse.kill() == Death(None, signal.SIGKILL)
    wait_for(lambda: has_ended(int(started.read_text())))


def test_one_that_has_not_ended_has_no_death_yet() -> None:
    def work() -> int:
        time.sleep(60)
        return 0

    horse = Horse.start(work)

    assert horse.wait(0.05) is None
    horse.kill()


def test_memory_beyond_its_limit_is_refused() -> None:
    def fill() -> int:
        try:
            bytearray(400_000_000)
        except MemoryError:
            return 3
        return 0

    assert confined(fill, job_memory_bytes=100_000_000).code == 3


def test_a_file_beyond_its_limit_is_refused(tmp_path: Path) -> None:
    def write() -> int:
        try:
            (tmp_path / "large").write_bytes(bytes(2_000_000))
        except OSError:
            return 3
        return 0

    assert confined(write, job_file_bytes=1_000_000).code == 3


def test_its_processor_time_is_limited_and_it_leaves_no_core() -> None:
    def look() -> int:
        soft, hard = resource.getrlimit(resource.RLIMIT_CPU)
        core = resource.getrlimit(resource.RLIMIT_CORE)
        return 0 if 10 < soft < hard < 100 and core == (0, 0) else 1

    assert confined(look, job_timeout=10).code == 0


@pytest.mark.parametrize("program", [["true"], ["/bin/sh", "-c", "true"]])
def test_it_may_not_start_other_programs(program: list[str]) -> None:
    def start() -> int:
        try:
            subprocess.run(program, check=False)
        except PermissionError:
            return 3
        return 0

    assert confined(start).code == 3


def test_it_may_not_connect_elsewhere() -> None:
    with socket.create_server(("127.0.0.1", 0)) as elsewhere:
        address = elsewhere.getsockname()

        def connect() -> int:
            try:
                socket.create_connection(address).close()
            except PermissionError:
                return 3
            return 0

        assert confined(connect).code == 3
