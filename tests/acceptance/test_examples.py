"""The programs in examples/, run as they stand in an empty directory."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

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


def test_the_cells_of_the_notebook_run_one_after_the_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "agg")
    cells = json.loads((EXAMPLES / "refine.ipynb").read_text())["cells"]
    programs = {
        cell["id"]: "".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"
    }
    names: dict[str, Any] = {}

    shown = {name: value_of(program, names) for name, program in programs.items()}

    assert all(cell["outputs"] == [] for cell in cells if cell["cell_type"] == "code")
    assert "<iframe" in shown["refine"]._repr_html_()
    assert shown["proof"]
    titles = [axes.get_title() for axes in shown["draw"].axes]
    off = {words.partition(":")[0]: float(words.split()[1]) for words in titles}
    assert off["reference"] <= off["refined"] < off["scan"] / 2
    shown["draw"].savefig("drawn.png")
    written = {"torus.obj", "torus.json", "torus.certificate.npz", "drawn.png"}
    assert {path.name for path in tmp_path.iterdir()} == written


def value_of(program: str, names: dict[str, Any]) -> Any:
    """Run a cell among the names of those before it; what its last line is, a notebook shows."""
    *steps, last = ast.parse(program).body
    exec(compile(ast.Module(steps, []), "cell", "exec"), names)  # noqa: S102
    if isinstance(last, ast.Expr):
        return eval(compile(ast.Expression(last.value), "cell", "eval"), names)  # noqa: S307
    exec(compile(ast.Module([last], []), "cell", "exec"), names)  # noqa: S102
    return None


def test_new_exports_are_held_against_those_that_were_accepted(tmp_path: Path) -> None:
    said = run("gate_folder.py", tmp_path)

    assert said[0].startswith("proposed: deviation.max at most 0.000")
    assert said[1:] == ["good passes", "torn fails"]


def test_every_example_is_listed_and_every_listed_one_is_there() -> None:
    listed = (EXAMPLES / "README.md").read_text()

    for path in EXAMPLES.iterdir():
        assert path.name == "README.md" or f"[{path.name}]({path.name})" in listed
