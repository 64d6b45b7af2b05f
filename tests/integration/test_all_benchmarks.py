"""The page that all benchmarks are written to."""

from __future__ import annotations

import subprocess
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType

import pytest

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def every(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    return import_module("all")


def test_every_one_is_a_script_that_can_be_started(every: ModuleType) -> None:
    for benchmark in every.BENCHMARKS:
        assert 'if __name__ == "__main__"' in (BENCHMARKS / f"{benchmark.script}.py").read_text()


def test_one_that_needs_stored_files_says_so(every: ModuleType) -> None:
    [agreement] = every.chosen(["agreement"])

    assert "--data" in agreement.lacks(None)


def test_one_whose_library_is_missing_names_it(every: ModuleType) -> None:
    benchmark = every.Benchmark("script", "a title", modules=("sys", "there_is_none"))

    assert benchmark.lacks(None) == "there_is_none is not installed"


def test_the_page_has_the_table_the_machine_and_what_was_not_run(tmp_path: Path) -> None:
    page = tmp_path / "page.md"

    done = run("--quick", "--only", "confirming", "agreement", "--out", str(page))

    assert done.returncode == 0, done.stderr
    text = page.read_text()
    assert "cores |" in text
    assert "meshcone " in text
    assert "- `agreement`: it reads stored files" in text
    table = text.partition("```text\n")[2].partition("\n```")[0].splitlines()
    assert len(table) > 4
    assert set(table) <= {line.rstrip() for line in done.stdout.splitlines()}


def test_a_benchmark_that_fails_is_said_on_the_page(every: ModuleType) -> None:
    failing = every.Benchmark("confirming", "a title", "--subdivisions none")

    ended = every.run(failing, None, quick=True)

    assert ended.trouble == "It ended with 2.\n"


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(BENCHMARKS / "all.py"), *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=240, check=False)
