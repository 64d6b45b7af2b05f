"""What happens to a run of gates when processes of it end."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from tests.gate_assets import make_assets
from tests.processes import children_of

SLOW = [f"props/closed_0{number}.obj" for number in (4, 5, 6)]


@pytest.fixture
def assets(tmp_path: Path) -> Path:
    """Twenty assets, three of them bad."""
    make_assets(tmp_path)
    return tmp_path


def test_a_process_that_dies_takes_no_other_with_it(assets: Path) -> None:
    running = start(assets)
    try:
        [victim] = wait_for(lambda: engines(running.pid))
        os.kill(victim, signal.SIGKILL)
        _, told = running.communicate(timeout=240)
    finally:
        running.kill()

    document = json.loads((assets / "gate.json").read_text())
    assert running.returncode == 3
    assert "was ended by SIGKILL" in told
    assert document["counts"]["error"] == 1
    assert document["counts"]["pass"] == len(SLOW) - 1


def test_an_interrupt_ends_it_and_all_it_started(assets: Path) -> None:
    running = start(assets)
    try:
        [engine] = wait_for(lambda: engines(running.pid))
        running.send_signal(signal.SIGINT)
        _, told = running.communicate(timeout=60)
    finally:
        running.kill()

    assert (running.returncode, told) == (130, "")  # what a shell calls an interrupt
    wait_for(lambda: not Path(f"/proc/{engine}").exists())
    assert not (assets / "gate.json").exists()


def start(directory: Path) -> subprocess.Popen[str]:
    """Gate a few pairs slowly: one at a time, with an assignment of thousands of samples."""
    arguments = ["--manifest", "pairs.csv", "--gates", "gates.toml", "--json", "gate.json"]
    arguments += ["--jobs", "1", "--set", "quality.emd_samples=2048"]
    return subprocess.Popen(
        [sys.executable, "-m", "service.cli", "gate", *arguments, *SLOW],
        cwd=directory,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )


def engines(pid: int) -> list[int]:
    """Processes that work on a pair: the children of the one they are forked from."""
    return [worker for child in children_of(pid) for worker in children_of(child)]


def wait_for(condition: Callable[[], Any]) -> Any:
    deadline = time.monotonic() + 60
    while not (found := condition()):
        assert time.monotonic() < deadline, "it did not happen in time"
        time.sleep(0.01)
    return found
