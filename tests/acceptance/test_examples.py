"""The programs in examples/, run as they stand in an empty directory."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

EXAMPLES = Path(__file__).parents[2] / "examples"


def run(name: str, directory: Path) -> list[str]:
    done = subprocess.run(
        [sys.executable, str(EXAMPLES / name)],
        cwd=directory,
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def test_a_scan_is_refined_proven_and_drawn(tmp_path: Path) -> None:
    said = run("refine.py", tmp_path)

    assert "improved" in said[0]
    assert "(proven)" in said[1]
    assert said[2] == "verified"
    written = {"torus.obj", "torus.json", "torus.certificate.npz", "torus.png"}
    assert {path.name for path in tmp_path.iterdir()} == written


def test_new_exports_are_held_against_those_that_were_accepted(tmp_path: Path) -> None:
    said = run("gate_folder.py", tmp_path)

    assert said[0].startswith("proposed: deviation.max at most 0.000")
    assert said[1:] == ["good passes", "torn fails"]


def test_every_example_is_listed_and_every_listed_one_is_there() -> None:
    listed = (EXAMPLES / "README.md").read_text()

    for path in EXAMPLES.iterdir():
        assert path.name == "README.md" or f"[{path.name}]({path.name})" in listed
