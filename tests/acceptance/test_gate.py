"""``meshcone gate`` as a CI job uses it: a manifest, an exit code, reports for machines."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jsonschema
import junitparser
import numpy as np
import pytest
import xmlschema

from service.stack import Stack
from tests import shapes
from tests.processes import children_of
from tests.unit.gates.sarif_schema import LOG

Finished = subprocess.CompletedProcess[str]

PAIRS = 20
JUNIT = xmlschema.XMLSchema(Path(__file__).parents[1] / "unit" / "gates" / "junit.xsd")
GATES = """
unit = "mm"

[gates]
"point_to_surface.max" = { max_model = 0.3 }
"normal_consistency" = { min_ratio_to_floor = 0.95 }
"validity.non_manifold_edges" = { max = 0 }

[classes.closed]
match = ["closed_*"]
gates."validity.watertight" = { equals = true }
"""
SPIKE = 30  # a vertex
SLOW = [f"props/closed_0{number}.obj" for number in (4, 5, 6)]
QUICK = ("--set", "quality.samples=1000", "--set", "quality.emd_samples=64")


@pytest.fixture
def assets(tmp_path: Path) -> Path:
    """Twenty balls with a reference each; one has a spike, one a hole, one a fin."""
    vertices, faces = shapes.sphere(3)
    for directory in ("props", "masters"):
        (tmp_path / directory).mkdir()
    rows = ["source,reference"]
    for number in range(PAIRS):
        name = f"closed_{number:02}.obj" if number < 10 else f"prop {number:02}.obj"
        scale = 1 + number / 10
        source = shapes.noisy(scale * vertices, 0.005, seed=number)
        triangles = faces
        if number == 3:  # a hole
            triangles = faces[1:]
        if number == 7:  # a spike
            source[SPIKE] *= 1.2
        if number == 12:  # a fin: a third face at an edge
            source = np.vstack([source, source[faces[0, :2]].mean(axis=0) * 1.001])
            fin = [faces[0, 0], faces[0, 1], len(source) - 1]
            triangles = np.vstack([faces, fin])
        (tmp_path / "props" / name).write_bytes(shapes.obj(source, triangles))
        (tmp_path / "masters" / name).write_bytes(shapes.obj(scale * vertices, faces))
        rows.append(f"props/{name},masters/{name}")
    (tmp_path / "pairs.csv").write_text("\n".join(rows) + "\n")
    (tmp_path / "gates.toml").write_text(GATES)
    return tmp_path


def gate(directory: Path, *arguments: str) -> Finished:
    return subprocess.run(
        command(*arguments),
        cwd=directory,
        capture_output=True,
        text=True,
        check=False,
        timeout=240,
    )


def command(*arguments: str) -> list[str]:
    return [sys.executable, "-m", "service.cli", "gate", *arguments]


def gate_all(directory: Path, *arguments: str) -> Finished:
    outputs = ("--json", "gate.json", "--junit", "gate.xml", "--sarif", "gate.sarif")
    return gate(directory, "--manifest", "pairs.csv", "--gates", "gates.toml", *outputs, *arguments)


def sarif_results(directory: Path) -> list[dict[str, Any]]:
    log = json.loads((directory / "gate.sarif").read_text())
    jsonschema.validate(log, LOG)
    return log["runs"][0]["results"]


def assert_three_failures(directory: Path, finished: Finished) -> None:
    """Exit 1; the three bad assets, and only they, in every report."""
    JUNIT.validate((directory / "gate.xml").read_text())
    junit = junitparser.JUnitXml.fromfile(str(directory / "gate.xml"))
    document = json.loads((directory / "gate.json").read_text())
    bad = {
        "props/closed_03.obj": "validity.watertight/equals",
        "props/closed_07.obj": "point_to_surface.max/max_model",
        "props/prop 12.obj": "validity.non_manifold_edges/max",
    }

    assert (finished.returncode, finished.stderr) == (1, "")
    assert document["counts"] == {"error": 0, "fail": 3, "not_tested": 0, "pass": 17}
    assert (junit.failures, junit.errors, len(list(junit))) == (3, 0, PAIRS)
    assert {suite.name: case.name for suite in junit for case in suite if not case.is_passed} == bad
    results = sarif_results(directory)
    assert len(results) == 3
    assert {
        place["artifactLocation"]["uri"].replace("%20", " "): result["ruleId"]
        for result in results
        for place in [result["locations"][0]["physicalLocation"]]
    } == bad
    assert "20 assets: 3 FAILED, 17 pass" in finished.stdout


def test_three_bad_assets_of_twenty_are_three_failures(assets: Path) -> None:
    finished = gate_all(assets, "--jobs", "2", *QUICK)

    assert_three_failures(assets, finished)
    [line] = [line for line in finished.stdout.splitlines() if "closed_07.obj: " in line]
    assert line.startswith("FAILED      props/closed_07.obj: worst deviation 0.6")
    assert " mm near (" in line
    assert line.endswith("allowed 0.3 mm")


def test_a_service_finds_the_same(assets: Path, stack: Stack) -> None:
    finished = gate_all(assets, "--server", stack.url, "--jobs", "4", *QUICK)

    assert_three_failures(assets, finished)


def test_a_bad_file_does_not_stop_the_others(assets: Path) -> None:
    (assets / "props" / "closed_00.obj").write_text("Dear diary,\n")
    (assets / "masters" / "closed_01.obj").unlink()

    finished = gate_all(assets, *QUICK)

    junit = junitparser.JUnitXml.fromfile(str(assets / "gate.xml"))
    assert finished.returncode == 2
    assert finished.stderr.count("\n") == 2
    assert "meshcone: props/closed_00.obj: " in finished.stderr
    assert "cannot be read" in finished.stderr
    assert (junit.failures, junit.errors) == (3, 2)
    unusable = [each for each in sarif_results(assets) if each["ruleId"] == "unusable-file"]
    assert len(unusable) == 2


def test_one_pair_tells_every_check(assets: Path) -> None:
    pair = ("props/closed_07.obj", "masters/closed_07.obj")

    finished = gate(assets, *pair, "--gates", "gates.toml", *QUICK)

    assert finished.returncode == 1
    assert [line.split()[0] for line in finished.stdout.splitlines()] == ["FAILED", *3 * ["ok"]]


def test_a_pair_that_passes_exits_with_0(assets: Path) -> None:
    finished = gate(
        assets,
        *("props/closed_05.obj", "masters/closed_05.obj", "--gates", "gates.toml"),
        *("--sarif", "gate.sarif", *QUICK),
    )

    assert (finished.returncode, finished.stderr) == (0, "")
    assert sarif_results(assets) == []


def test_refining_can_make_an_asset_pass(assets: Path) -> None:
    pair = ("props/closed_07.obj", "masters/closed_07.obj")
    (assets / "refined.toml").write_text(
        'gates."point_to_surface.max" = { max_model = 0.3 }\n'
        'gates."point_to_surface.mean" = { max_ratio_to_input = 0.5 }\n'
        'gates."outcome" = { one_of = ["improved"] }\n'
    )

    finished = gate(assets, *pair, "--gates", "refined.toml", "--refine", "--set", "effort=fast")

    assert (finished.returncode, finished.stderr) == (0, "")


def test_a_refinement_without_gates_of_its_own_passes_through_a_service(
    assets: Path, stack: Stack
) -> None:
    pair = ("props/closed_07.obj", "masters/closed_07.obj")

    finished = gate(
        assets,
        *pair,
        *("--gates", "gates.toml", "--refine", "--server", stack.url, "--set", "effort=fast"),
    )

    assert (finished.returncode, finished.stderr) == (0, "")


def test_only_pairs_with_a_changed_file_are_gated(assets: Path) -> None:
    some = gate_all(assets, *QUICK, "masters/closed_07.obj", "props/prop 12.obj")
    none = gate_all(assets, "elsewhere.obj")

    assert "closed_07" in some.stdout
    assert "2 assets: 2 FAILED" in some.stdout
    assert (none.returncode, none.stdout) == (0, "no pair has one of these files\n")


def test_changed_gates_concern_every_pair(assets: Path) -> None:
    finished = gate_all(assets, *QUICK, "gates.toml")

    assert "20 assets" in finished.stdout


def test_an_asset_without_gates_has_not_passed(assets: Path) -> None:
    (assets / "gates.toml").write_text('[classes.a]\nmatch = ["closed_0[56].obj"]\ngates.emd.max=1')

    finished = gate_all(assets, *QUICK, "props/closed_05.obj", "props/prop 11.obj")

    assert finished.returncode == 1
    assert "2 assets: 1 not tested, 1 pass" in finished.stdout


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("a.obj", "b.obj"), "--gates is missing"),
        (("a.obj", "--gates", "gates.toml"), "expected SOURCE and REFERENCE, or --manifest"),
        (("a.obj", "b.obj", "--gates", "nowhere.toml"), "nowhere.toml: cannot be read"),
        (("a.obj", "b.obj", "--gates", "gates.toml"), "a.obj: cannot be read"),
        (("--manifest", "nowhere.csv", "--gates", "gates.toml"), "nowhere.csv: cannot be read"),
        (("a.obj", "b.obj", "--gates", "bad.toml"), "did you mean 'fscore'?"),
        (
            ("a.obj", "b.obj", "--gates", "gates.toml", "--junit", "nowhere/x.xml"),
            "nowhere/x.xml: cannot be written",
        ),
        (
            ("a.obj", "b.obj", "--gates", "gates.toml", "--set", "mode=refine"),
            "'mode' and 'gates' are set by --refine and --gates here",
        ),
        (
            ("a.obj", "b.obj", "--gates", "gates.toml", "--server", "http://127.0.0.1:9"),
            "no MeshCone service answers at http://127.0.0.1:9",
        ),
        (
            ("a.obj", "b.obj", "--gates", "gates.toml", "--server", "nonsense"),
            "no MeshCone service answers at nonsense",
        ),
    ],
)
def test_what_cannot_be_gated_is_told_in_one_line(
    assets: Path, arguments: tuple[str, ...], said: str
) -> None:
    (assets / "bad.toml").write_text("gates.fscor.min = 1")

    finished = gate(assets, *arguments)

    assert finished.returncode == 2
    assert said in finished.stderr
    assert finished.stderr.startswith("meshcone: ")
    assert finished.stderr.count("\n") == 1


def test_a_process_that_dies_takes_no_other_with_it(assets: Path) -> None:
    running = start(assets)
    try:
        [victim] = wait_for(lambda: engines(running.pid))
        os.kill(victim, signal.SIGKILL)
        _, told = running.communicate(timeout=240)
    finally:
        running.kill()

    document = json.loads((assets / "gate.json").read_text())
    assert running.returncode == 3
    assert "was ended by SIGKILL" in told
    assert document["counts"]["error"] == 1
    assert document["counts"]["pass"] == len(SLOW) - 1


def test_an_interrupt_ends_it_and_all_it_started(assets: Path) -> None:
    running = start(assets)
    try:
        [engine] = wait_for(lambda: engines(running.pid))
        running.send_signal(signal.SIGINT)
        _, told = running.communicate(timeout=60)
    finally:
        running.kill()

    assert (running.returncode, told) == (130, "")  # what a shell calls an interrupt
    wait_for(lambda: not Path(f"/proc/{engine}").exists())
    assert not (assets / "gate.json").exists()


def start(directory: Path) -> subprocess.Popen[str]:
    """Gate a few pairs slowly: one at a time, with an assignment of thousands of samples."""
    arguments = ("--manifest", "pairs.csv", "--gates", "gates.toml", "--json", "gate.json")
    return subprocess.Popen(
        command(*arguments, *SLOW, "--jobs", "1", "--set", "quality.emd_samples=2048"),
        cwd=directory,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )


def engines(pid: int) -> list[int]:
    """Processes that work on a pair: the children of the one they are forked from."""
    return [worker for child in children_of(pid) for worker in children_of(child)]


def wait_for(condition: Callable[[], Any]) -> Any:
    deadline = time.monotonic() + 60
    while not (found := condition()):
        assert time.monotonic() < deadline, "it did not happen in time"
        time.sleep(0.01)
    return found
