"""``meshcone gate`` as a CI job uses it: a manifest, an exit code, reports for machines."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import jsonschema
import junitparser
import pytest
import xmlschema

from meshcone.gates.files import parse_gate_file
from service.client import Client
from service.stack import Stack
from tests import shapes
from tests.commands import Finished, meshcone
from tests.gate_assets import PAIRS, make_assets
from tests.unit.gates.sarif_schema import LOG

JUNIT = xmlschema.XMLSchema(Path(__file__).parents[1] / "unit" / "gates" / "junit.xsd")
QUICK = ("--set", "quality.samples=1000", "--set", "quality.emd_samples=64")


@pytest.fixture
def assets(tmp_path: Path) -> Path:
    """Twenty assets, three of them bad."""
    make_assets(tmp_path)
    return tmp_path


def gate(directory: Path, *arguments: str) -> Finished:
    return meshcone(directory, "gate", *arguments)


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
    assert [each["ruleId"] for each in results if each["level"] == "warning"] == [
        "edges.non_manifold"
    ]
    failed = [each for each in results if each["level"] == "error"]
    assert len(failed) == 3
    assert {
        place["artifactLocation"]["uri"].replace("%20", " "): result["ruleId"]
        for result in failed
        for place in [result["locations"][0]["physicalLocation"]]
    } == bad
    assert "warning     edges.non_manifold: props/prop 12.obj: The source has" in finished.stdout
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
    assert [line.split()[0] for line in finished.stdout.splitlines()] == [
        "proven",
        "FAILED",
        *3 * ["ok"],
    ]


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


def test_where_no_pair_has_a_changed_file_no_report_of_an_earlier_run_stays(
    assets: Path, tmp_path: Path
) -> None:
    reports = [tmp_path / name for name in ("a.json", "a.xml", "a.sarif", "a.html", "a.md")]
    for report in reports:
        report.write_text("of an earlier run")
    kinds = ("--json", "--junit", "--sarif", "--html", "--markdown")
    options = [word for pair in zip(kinds, map(str, reports), strict=True) for word in pair]

    finished = gate_all(assets, *options, "props/mistyped.obj")

    assert finished.returncode == 0
    assert "props/mistyped.obj: is not there" in finished.stderr
    assert json.loads(reports[0].read_bytes())["assets"] == []
    assert not [each for each in reports if each.read_text() == "of an earlier run"]


def test_a_chain_is_gated_level_by_level(tmp_path: Path) -> None:
    for level, detail in enumerate((4, 3, 2, 1)):
        ball = shapes.obj(*shapes.sphere(detail))
        (tmp_path / f"ball_LOD{level}.obj").write_bytes(ball)
    (tmp_path / "gates.toml").write_text("gates.inputs.source.faces = { max = [512, 128, 31] }")

    finished = gate(
        tmp_path,
        *("--manifest", "*_LOD[1-9].obj", "--reference-pattern", "{stem}_LOD0.obj"),
        *("--gates", "gates.toml", "--json", "gate.json", "--markdown", "gate.md", *QUICK),
        *("--label", "nightly"),
    )

    document = json.loads((tmp_path / "gate.json").read_text())
    assert (finished.returncode, finished.stderr) == (1, "")
    assert document["label"] == "nightly"
    assert {
        (asset["lod"], asset["source"], asset["reference"], asset["verdict"]["verdict"])
        for asset in document["assets"]
    } == {
        (1, "ball_LOD1.obj", "ball_LOD0.obj", "pass"),
        (2, "ball_LOD2.obj", "ball_LOD0.obj", "pass"),
        (3, "ball_LOD3.obj", "ball_LOD0.obj", "fail"),
    }
    [row] = [each for each in (tmp_path / "gate.md").read_text().splitlines() if "| ❌" in each]
    assert "ball_LOD3.obj" in row
    assert "32, allowed 31" in row


def test_a_folder_is_gated_against_a_folder(assets: Path) -> None:
    (assets / "masters" / "closed_08.obj").rename(assets / "masters" / "lost.obj")

    finished = gate(
        assets,
        *("props", "masters", "--gates", "gates.toml", "--junit", "gate.xml", *QUICK),
    )

    assert finished.returncode == 2
    assert "21 assets: 2 ERROR, 3 FAILED, 16 pass" in finished.stdout
    assert finished.stderr.splitlines() == [
        "meshcone: props/closed_08.obj: masters/closed_08.obj: cannot be read: "
        "no such file or directory",
        "meshcone: props/lost.obj: cannot be read: no such file or directory",
    ]


def test_a_folder_is_held_against_a_profile(tmp_path: Path) -> None:
    ball = shapes.obj(*shapes.sphere(1))
    (tmp_path / "sound.obj").write_bytes(ball)
    (tmp_path / "undefined.obj").write_bytes(ball.replace(b"\nf ", b"\nusemtl steel\nf ", 1))

    finished = gate(tmp_path, ".", "--profile", "web", "--json", "gate.json")

    document = json.loads((tmp_path / "gate.json").read_text())
    assert (finished.returncode, finished.stderr) == (1, "")
    assert document["counts"] == {"error": 0, "fail": 1, "not_tested": 0, "pass": 1}
    assert "undefined.obj: asset.materials.undefined 1, allowed 0" in finished.stdout


def test_a_service_holds_an_asset_against_a_profile(tmp_path: Path, stack: Stack) -> None:
    (tmp_path / "ball.obj").write_bytes(shapes.obj(*shapes.sphere(1)))

    finished = gate(tmp_path, "ball.obj", "--profile", "web", "--server", stack.url)

    assert (finished.returncode, finished.stderr) == (0, "")
    assert "ok          asset.budget.triangles 32, allowed 100000" in finished.stdout


def test_a_profile_is_printed_as_a_gate_file(tmp_path: Path) -> None:
    finished = gate(tmp_path, "--profile", "print", "--print")

    assert finished.returncode == 0
    assert "3MF Core Specification" in finished.stdout
    assert "asset.geometry.watertight" in parse_gate_file(
        "print.toml", finished.stdout.encode(), "audit"
    ).for_asset("a.obj")


def test_jobs_of_a_labelled_run_are_found_by_its_label(assets: Path, stack: Stack) -> None:
    pair = ("props/closed_05.obj", "masters/closed_05.obj")

    gate(assets, *pair, "--gates", "gates.toml", "--server", stack.url, "--label", "branch 7")

    with Client(stack.url) as client:
        [job] = client.jobs(label="branch 7").jobs
    assert job.labels == ["branch 7", "props/closed_05.obj"]


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
        (
            ("a.obj", "--gates", "gates.toml"),
            "gate 'point_to_surface.max': only a measurement or a refinement has this value",
        ),
        (("--gates", "gates.toml"), "expected SOURCE and REFERENCE, or --manifest"),
        (("a.obj", "--profile", "wed"), "unknown profile 'wed'; did you mean 'web'?"),
        (("--print",), "--print needs --profile"),
        (("a.obj", "b.obj", "--gates", "nowhere.toml"), "nowhere.toml: cannot be read"),
        (("a.obj", "b.obj", "--gates", "gates.toml"), "a.obj: cannot be read"),
        (("--manifest", "nowhere.csv", "--gates", "gates.toml"), "nowhere.csv: cannot be read"),
        (("a.obj", "b.obj", "--gates", "bad.toml"), "did you mean 'fscore'?"),
        (
            ("a.obj", "b.obj", "--gates", "gates.toml", "--junit", "nowhere/x.xml"),
            "nowhere/x.xml: cannot be written",
        ),
        (
            ("a.obj", "b.obj", "--gates", "gates.toml", "--label", "a\nb"),
            "--label must be one line",
        ),
        (
            ("a.obj", "b.obj", "--gates", "levels.toml"),
            "gate 'emd' has a bound for each level of detail, but 'a.obj' has no level",
        ),
        (
            ("a.obj", "b.glb", "--gates", "inches.toml"),
            "a.obj: gate 'deviation.max': a glTF is in metres, and 'inch' is not a known unit",
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
    (assets / "levels.toml").write_text("gates.emd.max = [1, 2]")
    (assets / "inches.toml").write_text("unit = 'inch'\ngates.'deviation.max'.max_model = 1")

    finished = gate(assets, *arguments)

    assert finished.returncode == 2
    assert said in finished.stderr
    assert finished.stderr.startswith("meshcone: ")
    assert finished.stderr.count("\n") == 1
