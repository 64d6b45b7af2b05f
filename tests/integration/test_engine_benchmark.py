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

from meshcone.surface import Mesh, SurfaceTree
from tests.meshes import sheet, sphere

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


def run(script: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(BENCHMARKS / script), *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)


@pytest.fixture
def flips(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    return import_module("flips")


@pytest.fixture
def speed_row(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    return import_module("speed_row")


@pytest.fixture
def descent(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    module = import_module("descent")
    monkeypatch.setattr(module, "_SAMPLES", 2000)
    return module


def test_every_method_is_measured_on_every_degraded_shape(tmp_path: Path) -> None:
    results = tmp_path / "engine.json"

    done = run(
        "engine.py",
        *("--vertices", "200", "--only", "t", "--effort", "fast"),
        *("--degradations", "noise_2,spikes", "--peers", "projection,taubin"),
        *("--json", str(results)),
    )

    assert done.returncode == 0, done.stderr
    rows: list[dict[str, Any]] = json.loads(results.read_text())["rows"]
    found = {(row["shape"], row["degradation"], row["method"]) for row in rows}
    assert found == {
        (shape, degradation, method)
        for shape in ("torus", "thin_plate", "two_components")
        for degradation in ("noise_2", "spikes")
        for method in ("fast", "projection", "taubin")
    }
    assert all(row["ratio"] < 1 for row in rows if row["method"] == "fast")
    assert "noise_2: point-to-surface distance" in done.stdout
    assert "fast: of 6 answers 0 harm their input" in done.stdout


def test_a_run_that_has_no_time_says_what_it_did_not_begin(tmp_path: Path) -> None:
    results = tmp_path / "engine.json"

    done = run(
        "engine.py",
        *("--vertices", "100", "--effort", "fast", "--degradations", "noise_2", "--peers", ""),
        *("--minutes", "0", "--json", str(results)),
    )

    assert done.returncode == 1
    written = json.loads(results.read_text())
    assert written["rows"] == []
    assert len(written["broken"]) == 5
    assert set(written["broken"].values()) == {"not begun: the minutes were over"}


def test_a_speed_row_says_how_many_cones_were_active() -> None:
    case = {"method": "engine", "vertices": 200, "constraint": "displacement", "active": 0.3}

    done = run("speed_row.py", json.dumps(case))

    assert done.returncode == 0, done.stderr
    row = json.loads(done.stdout)
    assert row["vertices"] == 200
    assert 0.1 < row["active_share"] < 0.5
    assert row["seconds"] > 0
    assert row["ratio"] < 1


def test_another_solver_reaches_the_same_optimum(speed_row: ModuleType) -> None:
    ours, theirs = (
        speed_row.measure(speed_row.Case(method, 200, constraint="displacement", active=0.3))
        for method in ("engine, last round", "clarabel")
    )

    assert theirs["objective"] == pytest.approx(ours["objective"], rel=1e-3)


def test_a_face_turned_over_counts_as_flipped(flips: ModuleType) -> None:
    reference = sphere(2)
    turned = reference.vertices.copy()
    turned[0] *= -1.0  # through the centre, so that its faces fold back

    facing = flips.FacingReference(SurfaceTree(reference))

    assert flips.flipped_faces(reference, reference, facing) == 0
    assert flips.flipped_faces(reference, reference.moved_to(turned), facing) > 0


def test_either_side_of_a_double_sided_sheet_is_right(flips: ModuleType) -> None:
    front = sheet(4, 4)
    both = Mesh(front.vertices, np.concatenate([front.faces, front.faces[:, ::-1]]))
    mirrored = front.vertices * [-1, 1, 1] + [3, 0, 0]

    one_sided = flips.FacingReference(SurfaceTree(front))
    double_sided = flips.FacingReference(SurfaceTree(both))

    assert flips.flipped_faces(front, front.moved_to(mirrored), one_sided) == len(front.faces)
    assert flips.flipped_faces(front, front.moved_to(mirrored), double_sided) == 0


def test_an_input_that_is_inside_out_is_not_flipped_by_staying_so(flips: ModuleType) -> None:
    reference = sphere(2)
    inside_out = Mesh(reference.vertices, reference.faces[:, ::-1])

    facing = flips.FacingReference(SurfaceTree(reference))

    assert flips.flipped_faces(inside_out, inside_out, facing) == 0


def test_the_slope_that_the_descent_follows_is_that_of_the_distance(descent: ModuleType) -> None:
    reference, draw = sphere(2), np.random.default_rng(0)
    source = reference.moved_to(reference.vertices + draw.normal(size=(162, 3)) * 0.02)
    distance = descent.Distance.drawn(source, reference, SurfaceTree(reference), 1)
    at, way, step = source.vertices.ravel(), draw.normal(size=486), 1e-7

    ahead, behind = (distance.at(at + sign * step * way)[0] for sign in (1, -1))

    assert distance.at(at)[1] @ way == pytest.approx((ahead - behind) / (2 * step), rel=1e-3)


def test_the_descent_brings_a_noisy_ball_back(descent: ModuleType) -> None:
    reference, draw = sphere(2), np.random.default_rng(0)
    source = reference.moved_to(reference.vertices + draw.normal(size=(162, 3)) * 0.02)
    tree = SurfaceTree(reference)
    before = descent.Distance.drawn(source, reference, tree, 1).at(source.vertices.ravel())[0]

    after, _ = descent.descended(source, reference, tree, 1)

    assert after < 0.1 * before
