from __future__ import annotations

import csv
import io
import json
import os
import shlex
import signal
import struct
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from meshcone.assets import read_asset
from tests.holding import Hold

TIMEOUT = 240  # seconds; a guard, not an expectation
MARK = "MESHCONE_TEST_RUN"  # an environment variable all descendants of a run inherit

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """A demo that ran to its end: the directory of its files, and what it printed."""
    out = tmp_path_factory.mktemp("demo") / "out"
    done = subprocess.run(
        [sys.executable, "-m", "service.cli", "demo", "--out", str(out)],
        env={**os.environ, MARK: str(out)},
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    return out, done.stdout


@pytest.fixture(scope="module")
def report(finished: tuple[Path, str]) -> dict[str, Any]:
    loaded: dict[str, Any] = json.loads((finished[0] / "report.json").read_text())
    return loaded


def test_demo_improves_its_mesh(report: dict[str, Any]) -> None:
    assert report["outcome"] == "improved"


def test_demo_brings_the_surface_five_times_closer(report: dict[str, Any]) -> None:
    before, after = (
        report["quality"][name]["point_to_surface"]["mean"] for name in ("input", "refined")
    )
    assert after <= before / 5


@pytest.mark.parametrize("name", ["source.glb", "reference.glb"])
def test_demo_leaves_meshes_of_one_structure(finished: tuple[Path, str], name: str) -> None:
    refined, other = (
        read_asset(name, (finished[0] / name).read_bytes()) for name in ("refined.glb", name)
    )
    assert refined.counts() == other.counts()
    assert np.array_equal(refined.faces, other.faces)


@pytest.mark.parametrize("name", ["before-after.png", "convergence.png"])
def test_demo_leaves_pictures(finished: tuple[Path, str], name: str) -> None:
    data = (finished[0] / name).read_bytes()
    assert data.startswith(b"\x89PNG\r\n\x1a\n")
    width, height = struct.unpack_from(">II", data, 16)
    assert 1000 < width < 2000
    assert 300 < height < 1500
    assert 20_000 < len(data) < 2_000_000  # neither blank nor noise


def test_demo_leaves_a_row_for_each_logged_iteration(
    finished: tuple[Path, str], report: dict[str, Any]
) -> None:
    rows = list(csv.DictReader(io.StringIO((finished[0] / "diagnostics.csv").read_text())))
    logged = [len(record["history"].get("iter", [])) for record in report["solver"]["rounds"]]
    assert len(rows) == sum(logged) > 0


def test_demo_prints_plain_lines_into_a_log(finished: tuple[Path, str]) -> None:
    output = finished[1]
    assert "\x1b" not in output
    assert "job succeeded" in output
    assert "point_to_surface.mean" in output
    assert "outcome        improved" in output


def test_demo_prints_the_command_that_checks_its_result_again(finished: tuple[Path, str]) -> None:
    (line,) = [line for line in finished[1].splitlines() if " verify " in line]

    again = subprocess.run(
        shlex.split(line),
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        check=False,
    )

    assert (again.returncode, again.stderr) == (0, "")
    assert "FAILED" not in again.stdout


def test_the_command_line_writes_the_bytes_the_demos_worker_wrote(
    finished: tuple[Path, str], tmp_path: Path
) -> None:
    pair = [str(finished[0] / name) for name in ("source.glb", "reference.glb")]
    out = ["-o", "refined.glb", "--report", "report.json"]

    subprocess.run(
        [sys.executable, "-m", "service.cli", "refine", *pair, *out],
        cwd=tmp_path,
        timeout=TIMEOUT,
        check=True,
    )

    for name in ("refined.glb", "report.certificate.npz"):
        # Compared outside the assertion: what differs in megabytes nobody wants spelled out.
        same = (tmp_path / name).read_bytes() == (finished[0] / name).read_bytes()
        assert same, name


def test_demo_leaves_no_process(finished: tuple[Path, str]) -> None:
    assert marked_processes(str(finished[0])) == []


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("moment", ["starting a broker", "sent source.glb"])
def test_interrupted_demo_leaves_nothing(
    tmp_path: Path,
    tmp_path_factory: pytest.TempPathFactory,
    number: signal.Signals,
    moment: str,
) -> None:
    hold = Hold(tmp_path_factory.mktemp("held"), sources="source.glb")  # the demo's only job
    for line in interrupted_at(moment, number, tmp_path, hold):
        assert "Traceback" not in line
    assert wait_for_none(str(tmp_path)) == []
    assert list(tmp_path.iterdir()) == []


def test_failed_demo_leaves_the_log_of_its_service(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "service.cli", "demo", "--out", str(tmp_path)],
        env={**os.environ, "MESHCONE_MAX_UPLOAD_BYTES": "10"},
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        check=False,
    )
    assert done.returncode == 3
    assert "10 bytes" in done.stderr
    assert len(done.stderr.splitlines()) == 1
    assert (tmp_path / "service.log").stat().st_size > 0


def interrupted_at(moment: str, number: signal.Signals, out: Path, hold: Hold) -> Iterator[str]:
    """Run the demo, send it a signal once it has printed ``moment``, yield all it prints."""
    process = subprocess.Popen(
        [sys.executable, "-u", "-m", "service.cli", "demo", "--out", str(out)],
        env={**os.environ, **hold.environment(), MARK: str(out), "TMPDIR": str(out)},
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    assert process.stdout is not None
    with process:
        for line in process.stdout:
            yield line
            if moment in line:
                process.send_signal(number)
        assert process.wait(TIMEOUT) != 0


def wait_for_none(mark: str) -> list[int]:
    """The processes of a run, once there are none or a minute has passed."""
    deadline = time.monotonic() + 60
    while (left := marked_processes(mark)) and time.monotonic() < deadline:
        time.sleep(0.1)
    return left


def marked_processes(mark: str) -> list[int]:
    if not Path("/proc/self/environ").exists():
        pytest.skip("processes can be looked at in /proc only")
    found = []
    for entry in Path("/proc").glob("[0-9]*/environ"):
        try:
            environment = entry.read_bytes().split(b"\0")
        except OSError:  # ended meanwhile, or another user's
            continue
        if f"{MARK}={mark}".encode() in environment:
            found.append(int(entry.parent.name))
    return found
