"""A working directory that holds packages of the names this program uses for its own."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from meshcone.gates.files import parse_gate_file
from tests import shapes
from tests.calling import Caller, small_form
from tests.integration.waiting import wait_for
from tests.processes import children_of

MESHCONE = Path(sys.executable).parent / "meshcone"


@pytest.fixture
def directory(tmp_path: Path) -> Path:
    """Two folders of assets beside packages that must not be imported."""
    for name in ("meshcone", "service", "worker"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("raise RuntimeError('the wrong package')\n")
    for folder in ("accepted", "references"):
        (tmp_path / folder).mkdir()
        for level in (1, 2):
            ball = shapes.obj(*shapes.sphere(level))
            (tmp_path / folder / f"ball{level}.obj").write_bytes(ball)
    return tmp_path


def meshcone(directory: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [MESHCONE, *arguments],
        cwd=directory,
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )


def test_gates_are_proposed_from_a_folder_and_pass_what_they_came_from(directory: Path) -> None:
    few = ("--set", "quality.samples=500", "--set", "quality.emd_samples=64")
    proposed = meshcone(directory, "thresholds", "accepted", "references", "-o", "g.toml", *few)
    assert (proposed.returncode, proposed.stderr) == (0, "")
    gates = parse_gate_file("g.toml", (directory / "g.toml").read_bytes(), "measure").gates
    assert {"deviation.max", "asset.budget.triangles", "changes.lost.materials"} <= set(gates)

    judged = meshcone(directory, "gate", "accepted", "references", "--gates", "g.toml", *few)

    assert "2 assets: 2 pass" in judged.stdout


def test_an_asset_that_cannot_be_used_proposes_nothing(directory: Path) -> None:
    (directory / "accepted" / "broken.obj").write_text("v 0 0 0\n")

    refused = meshcone(directory, "thresholds", "accepted")

    assert refused.returncode == 2
    assert "broken.obj" in refused.stderr
    assert refused.stdout == ""


def test_the_service_works_there(directory: Path) -> None:
    with subprocess.Popen(
        [MESHCONE, "serve", "--port", "0"],
        cwd=directory,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    ) as process:
        try:
            assert process.stdout is not None
            url = process.stdout.readline().split()[3]
            with Caller(url) as caller:
                wait_for(lambda: caller.readiness()[0] == 200)
                assert caller.submit(small_form()).status_code == 202
                wait_for(caller.has_seen_all_end)
                assert caller.states() == {"succeeded"}
            assert children_of(process.pid)
        finally:
            process.terminate()
