"""SARIF, held against the standard's rules and read by somebody else's reader."""

from __future__ import annotations

import json
from typing import Any

import jsonschema
import pytest
from sarif_pydantic import Sarif

from meshcone.gates.formats.sarif import UNUSABLE, to_sarif
from meshcone.gates.results import NO_GATE, GateRun
from meshcone.notices import Code, WarningRecord, warning
from tests.unit.gates.runs import MIXED, OPPOSED, asset, check, warned
from tests.unit.gates.sarif_schema import LOG

VALIDATOR = jsonschema.Draft202012Validator(LOG, format_checker=jsonschema.FormatChecker())


def run_of(run: GateRun) -> dict[str, Any]:
    [only] = json.loads(to_sarif(run))["runs"]
    return only


def results(run: GateRun) -> dict[tuple[str, str], dict[str, Any]]:
    return {
        (run.assets[place["artifactLocation"]["index"]].name, result["ruleId"]): result
        for result in run_of(run)["results"]
        for place in [result["locations"][0]["physicalLocation"]]
    }


def test_it_is_valid() -> None:
    VALIDATOR.check_schema(LOG)
    VALIDATOR.validate(json.loads(to_sarif(MIXED)))


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (["version"], "2.0.0"),
        (["runs", 0, "results", 0, "level"], "fatal"),
        (["runs", 0, "results", 0, "kind"], "open"),
        (["runs", 0, "results", 0, "rule_id"], "emd"),
        (["runs", 0, "results", 0, "message"], "words"),
        (["runs", 0, "artifacts", 0, "location", "uri"], 1),
    ],
)
def test_the_schema_would_notice(path: list[Any], value: Any) -> None:
    document = section = json.loads(to_sarif(MIXED))
    for step in path[:-1]:
        section = section[step]
    section[path[-1]] = value

    assert list(VALIDATOR.iter_errors(document))


@pytest.mark.parametrize("warnings", [(), (warning(Code.GATES_NONE, "pair", NO_GATE),)])
def test_that_no_gate_applies_is_open(warnings: tuple[WarningRecord, ...]) -> None:
    run = GateRun.of([asset("ball.obj").model_copy(update={"warnings": warnings})])

    VALIDATOR.validate(json.loads(to_sarif(run)))
    [found] = run_of(run)["results"]
    assert (found["ruleId"], found["kind"], found["level"]) == ("gates.none", "open", "none")


def test_another_reader_finds_the_same() -> None:
    [read] = Sarif.model_validate_json(to_sarif(MIXED)).runs

    assert read.tool.driver.name == "MeshCone"
    assert [result.rule_id for result in read.results or []] == [
        "emd/max",
        "chamfer/max",
        "emd/max",
        "chamfer/max",
        UNUSABLE,
    ]


def test_what_passed_is_no_result() -> None:
    assert not [key for key in results(MIXED) if key[0] == "good.obj"]


def test_the_level_is_the_severity_of_what_failed() -> None:
    found = results(MIXED)

    assert found["bad one.obj", "emd/max"]["level"] == "error"
    assert found["warned.obj", "chamfer/max"]["level"] == "warning"
    assert found["open.obj", "emd/max"]["kind"] == "open"
    assert found["open.obj", "emd/max"]["level"] == "none"


def test_a_warning_is_a_result_under_its_code() -> None:
    other = OPPOSED.model_copy(update={"side": "source", "where": "wheel"})
    run = GateRun.of([warned("ball.obj", OPPOSED, other)])

    VALIDATOR.validate(json.loads(to_sarif(run)))
    first, second = run_of(run)["results"]
    assert (first["ruleId"], first["level"]) == ("normals.opposed", "warning")
    assert second["properties"] == {"side": "source", "where": "wheel"}
    assert first["partialFingerprints"] != second["partialFingerprints"]
    rules = {rule["id"]: rule for rule in run_of(run)["tool"]["driver"]["rules"]}
    assert rules["normals.opposed"]["defaultConfiguration"] == {"level": "warning"}
    assert "oppose" in rules["normals.opposed"]["shortDescription"]["text"]


def test_a_result_points_to_its_file_and_its_rule() -> None:
    result = results(MIXED)["bad one.obj", "emd/max"]

    place = result["locations"][0]["physicalLocation"]["artifactLocation"]
    rules = run_of(MIXED)["tool"]["driver"]["rules"]
    assert (place["uri"], place["uriBaseId"]) == ("bad%20one.obj", "%SRCROOT%")
    assert rules[result["ruleIndex"]]["id"] == "emd/max"
    assert result["message"]["text"] == "bad one.obj: emd fail <&>"
    assert result["properties"]["position"] == [1.0, 2.0, 3.0]


def test_a_file_elsewhere_has_an_absolute_address() -> None:
    run = GateRun.of([asset("a", check("fail"), source="/assets/a b.obj")])

    assert run_of(run)["artifacts"][0]["location"] == {"uri": "file:///assets/a%20b.obj"}


def test_a_file_that_was_fetched_has_the_address_it_was_fetched_from() -> None:
    run = GateRun.of([asset("mug", check("pass"), source="s3://assets/mug.glb")])

    [file] = run_of(run)["artifacts"]

    assert file["location"] == {"uri": "s3://assets/mug.glb"}


def test_a_file_of_several_assets_is_listed_once() -> None:
    pair = [asset(name, check("fail"), source="mug.glb") for name in ("a", "b")]

    run = run_of(GateRun.of(pair))

    VALIDATOR.validate(json.loads(to_sarif(GateRun.of(pair))))
    assert len(run["artifacts"]) == 1
    assert [
        result["locations"][0]["physicalLocation"]["artifactLocation"]["index"]
        for result in run["results"]
    ] == [0, 0]


def test_a_file_that_could_not_be_used_is_a_finding_about_it() -> None:
    result = results(MIXED)["cut\x0b.glb", UNUSABLE]

    assert result["level"] == "error"
    assert "the file ends too early" in result["message"]["text"]


def test_a_fault_of_ours_is_no_finding_but_told() -> None:
    [invocation] = run_of(MIXED)["invocations"]
    [fault] = invocation["toolExecutionNotifications"]

    assert not invocation["executionSuccessful"]
    assert "SIGKILL" in fault["message"]["text"]
    assert not [key for key in results(MIXED) if key[0] == "huge.obj"]


def test_the_same_finding_keeps_its_fingerprint() -> None:
    again = GateRun.of([asset("new.obj", check("pass")), *MIXED.assets])

    before, after = (results(run)["bad one.obj", "emd/max"] for run in (MIXED, again))
    assert before["partialFingerprints"] == after["partialFingerprints"]
    prints = {each["partialFingerprints"]["assetAndRule/v1"] for each in results(MIXED).values()}
    assert len(prints) == len(results(MIXED))


def test_a_label_tells_the_run_from_others() -> None:
    labelled = GateRun.of(MIXED.assets, "nightly")

    VALIDATOR.validate(json.loads(to_sarif(labelled)))
    assert run_of(labelled)["automationDetails"] == {"id": "nightly/"}
    assert "automationDetails" not in run_of(MIXED)
