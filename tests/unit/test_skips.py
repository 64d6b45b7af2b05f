"""A skipped test fails in CI, and nowhere else."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

SKIPPING = "import pytest\n\ndef test_that_is_not_run():\n    pytest.skip('no browser here')\n"


@pytest.mark.parametrize(("ci", "code"), [("true", 1), ("", 0)])
def test_a_skip_fails_in_ci_alone(tmp_path: Path, ci: str, code: int):
    test = tmp_path / "test_skipping.py"
    test.write_text(SKIPPING)
    root = Path(__file__).parents[2]
    command = [sys.executable, "-m", "pytest", "-q", "-p", "tests.skips", "-c", os.devnull]

    run = subprocess.run(
        [*command, f"--rootdir={tmp_path}", str(test)],
        env={**os.environ, "CI": ci, "PYTHONPATH": str(root)},
        capture_output=True,
        text=True,
        check=False,
    )

    assert run.returncode == code, run.stdout
    assert ("no browser here" in run.stdout) == (ci == "true")
