from __future__ import annotations

import json
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from meshcone.surface import SurfaceTree
from tests.meshes import sphere

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.fixture
def paper_inputs(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    return import_module("paper_inputs")


@pytest.fixture
def paper_tables(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    return import_module("paper_tables")


def run(results: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    shape = ("--vertices", "200", "--only", "box", "--emd-samples", "64")
    command = [sys.executable, str(BENCHMARKS / "paper.py"), "--results", str(results)]
    return subprocess.run(
        [*command, *shape, *arguments], capture_output=True, text=True, timeout=240, check=False
    )


@pytest.fixture(scope="module")
def measured(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    results = tmp_path_factory.mktemp("paper")
    done = run(results, "--stages", "metrics,best,solver")
    assert done.returncode == 0, done.stderr
    return results, done.stdout


def metrics(results: Path, stage: str = "metrics") -> dict[str, Any]:
    found: dict[str, Any] = json.loads((results / "box.json").read_text())[stage]
    return found


@pytest.mark.slow
def test_the_centroid_program_copies_a_reference_of_the_same_size(
    measured: tuple[Path, str],
) -> None:
    rows = metrics(measured[0])

    assert rows["sphere_same"]["distance"] > 0.01
    assert rows["paper_same"]["distance"] < 1e-5
    assert rows["paper_same"]["surface_normals"] > 1 - 1e-5


@pytest.mark.slow
def test_the_centroid_program_returns_a_mesh_of_another_size_as_it_was(
    measured: tuple[Path, str],
) -> None:
    rows = metrics(measured[0])

    before, after = (rows[name] for name in ("sphere_own", "paper_own"))
    assert after["distance"] == pytest.approx(before["distance"], rel=1e-2)
    assert after["aspect_median"] == pytest.approx(before["aspect_median"], rel=1e-2)
    assert metrics(measured[0], "best")["best_own"]["distance"] < before["distance"] / 2


@pytest.mark.slow
def test_what_is_measured_is_not_measured_again(measured: tuple[Path, str]) -> None:
    results, printed = measured
    before = (results / "box.json").read_bytes()

    again = run(results, "--stages", "metrics,best,solver")

    assert again.stdout == printed
    assert (results / "box.json").read_bytes() == before


@pytest.mark.slow
def test_the_papers_numbers_stand_beside_ours(measured: tuple[Path, str]) -> None:
    solver = measured[1].partition("## Metrics")[0].splitlines()

    assert "| *the paper*: 53 meshes | 1.22 | 25 | 100 % |" in solver
    assert any(row.startswith("| as written, CVXPY and SCS |") for row in solver)


def test_a_sphere_of_the_same_size_has_the_targets_faces(paper_inputs: ModuleType) -> None:
    target = sphere(2).moved_to(sphere(2).vertices * [1.0, 0.5, 0.25])

    start = paper_inputs.same_size_sphere(target)

    assert np.array_equal(start.faces, target.faces)
    assert np.linalg.norm(start.vertices, axis=1) == pytest.approx(1.0)


def test_more_steps_bring_a_sphere_nearer_to_its_target(paper_inputs: ModuleType) -> None:
    target = sphere(3).moved_to(sphere(3).vertices * [1.0, 0.5, 0.25])
    tree = SurfaceTree(target)

    distances = [
        tree.closest(paper_inputs.deformed(sphere(3), target, steps).vertices).distances.mean()
        for steps in (0, 10, 40)
    ]

    assert distances[0] > 1.2 * distances[1] > 1.2**2 * distances[2]


@pytest.mark.parametrize(
    ("number", "written"),
    [
        (0.0, "0"),
        (0.0038, ".0038"),
        (0.91749, ".917"),
        (1.5, "1.5"),
        (25.0, "25"),
        (1000.0, "1000"),
        (1.6e-7, "2e-07"),
        (float("nan"), "–"),  # noqa: RUF001 - as in the tables
    ],
)
def test_a_number_is_written_short(paper_tables: ModuleType, number: float, written: str) -> None:
    assert paper_tables.short(number) == written
