"""What happens to a run of gates when processes of it end."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.gate_assets import make_assets
from tests.integration.waiting import wait_for
from tests.processes import children_of, has_ended

GATED = [f"props/closed_0{number}.obj" for number in (4, 5, 6)]


@dataclass(frozen=True)
class Run:
    """A run of gates, and its process that works on the first pair until it is ended."""

    process: subprocess.Popen[str]
    engine: int


@pytest.fixture
def assets(tmp_path: Path) -> Path:
    """Twenty assets; who reads the first of the gated ones waits for ever."""
    make_assets(tmp_path)
    (tmp_path / GATED[0]).unlink()
    os.mkfifo(tmp_path / GATED[0])
    return tmp_path


def test_a_process_that_dies_takes_no_other_with_it(assets: Path) -> None:
    with gating(assets) as run:
        os.kill(run.engine, signal.SIGKILL)
        _, told = run.process.communicate(timeout=240)

    document = json.loads((assets / "gate.json").read_text())
    assert run.process.returncode == 3
    assert "was ended by SIGKILL" in told
    assert document["counts"]["error"] == 1
    assert document["counts"]["pass"] == len(GATED) - 1


def test_an_interrupt_ends_it_and_all_it_started(assets: Path) -> None:
    with gating(assets) as run:
        run.process.send_signal(signal.SIGINT)
        _, told = run.process.communicate(timeout=240)

    assert (run.process.returncode, told) == (130, "")  # what a shell calls an interrupt
    wait_for(lambda: has_ended(run.engine))
    assert not (assets / "gate.json").exists()


def test_the_temporary_files_of_a_process_that_dies_are_removed(
    assets: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    with gating(assets) as run:
        [place] = tmp_path.glob("meshcone-job-*")
        (place / "scene.usd").touch()
        os.kill(run.engine, signal.SIGKILL)
        wait_for(lambda: not place.exists())


@contextmanager
def gating(directory: Path) -> Iterator[Run]:
    """Gate a few pairs one at a time, up to where the first is read."""
    arguments = ["--manifest", "pairs.csv", "--gates", "gates.toml", "--json", "gate.json"]
    process = subprocess.Popen(
        [sys.executable, "-m", "service.cli", "gate", *arguments, "--jobs", "1", *GATED],
        cwd=directory,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
    pipe = None
    try:
        pipe = opened_by_its_reader(directory / GATED[0])
        [engine] = engines(process.pid)
        yield Run(process, engine)
    finally:
        process.kill()
        process.wait()
        if pipe is not None:
            os.close(pipe)


def opened_by_its_reader(path: Path) -> int:
    """The end to write to of a pipe that somebody reads; they wait as long as it is open."""
    opened: list[int] = []

    def is_read() -> bool:
        with suppress(OSError):  # nobody reads it yet
            opened.append(os.open(path, os.O_WRONLY | os.O_NONBLOCK))
        return bool(opened)

    wait_for(is_read)
    return opened[0]


def engines(pid: int) -> list[int]:
    """Processes that work on a pair: the children of the one they are forked from."""
    return [worker for child in children_of(pid) for worker in children_of(child)]
