"""The tests' way to run commands: one that is forked does as one that is started."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from meshcone.files import MeshFile
from tests.commands import meshcone


@pytest.mark.parametrize(
    "arguments",
    [[], ["--version"], ["measure", "ball.obj", "ball.obj"], ["measure", "none.obj", "ball.obj"]],
)
def test_a_forked_command_ends_as_a_started_one(
    tmp_path: Path, ball: MeshFile, arguments: list[str]
) -> None:
    (tmp_path / "ball.obj").write_bytes(ball.data)

    forked = meshcone(tmp_path, *arguments)

    started = subprocess.run(
        [sys.executable, "-m", "service.cli", *arguments],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )
    assert (forked.returncode, forked.stdout, forked.stderr) == (
        started.returncode,
        started.stdout,
        started.stderr,
    )


def test_each_command_has_the_variables_it_is_given_and_no_others(
    tmp_path: Path, ball: MeshFile
) -> None:
    (tmp_path / "ball.obj").write_bytes(ball.data)
    pair = ("ball.obj", "ball.obj")

    limited = meshcone(tmp_path, "measure", *pair, MESHCONE_LIMIT_VERTICES="3")
    unlimited = meshcone(tmp_path, "measure", *pair)

    assert (limited.returncode, unlimited.returncode) == (2, 0)
