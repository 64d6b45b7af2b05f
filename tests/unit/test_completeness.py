"""A skipped test fails in CI, and nowhere else; a test that was not run fails everywhere."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from subprocess import CompletedProcess

import pytest

from tests.conftest import LONGEST_FILES

SKIPPING = "import pytest\n\ndef test_that_is_not_run():\n    pytest.skip('no browser here')\n"


# xdist, sharing out by file, runs one of the tests that go by the same name.
SAME_NAME = "def pytest_collection_modifyitems(items):\n    items.append(items[0])\n"


@pytest.mark.parametrize(("ci", "code"), [("true", 1), ("", 0)])
def test_a_skip_fails_in_ci_alone(tmp_path: Path, ci: str, code: int):
    (tmp_path / "test_skipping.py").write_text(SKIPPING)

    run = pytest_in(tmp_path, CI=ci)

    assert run.returncode == code, run.stdout
    assert ("no browser here" in run.stdout) == (ci == "true")


@pytest.mark.parametrize(("sharing", "code"), [([], 0), (["-n", "2", "--dist", "loadfile"], 1)])
def test_a_test_that_is_lost_in_sharing_out_fails_the_run(
    tmp_path: Path, sharing: list[str], code: int
):
    (tmp_path / "test_passing.py").write_text("def test_that_passes():\n    pass\n")
    (tmp_path / "conftest.py").write_text(SAME_NAME)

    run = pytest_in(tmp_path, *sharing)

    assert run.returncode == code, run.stdout
    assert ("1 of 2 tests never ended" in run.stdout) == (code == 1)


def test_the_files_that_begin_first_are_there():
    root = Path(__file__).parents[1]

    assert [name for name in LONGEST_FILES if not (root / name).is_file()] == []


def pytest_in(directory: Path, *arguments: str, **environment: str) -> CompletedProcess[str]:
    """Run the tests of a directory as this project runs its own."""
    command = [sys.executable, "-m", "pytest", "-q", "-p", "tests.completeness", "-p", "xdist"]
    root = Path(__file__).parents[2]
    return subprocess.run(
        [*command, "-c", os.devnull, f"--rootdir={directory}", *arguments, str(directory)],
        # What other plugins import takes seconds.
        env={
            **os.environ,
            "PYTHONPATH": str(root),
            "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
            **environment,
        },
        capture_output=True,
        text=True,
        check=False,
    )
