"""JUnit XML, held against a schema and read by somebody else's reader."""

from __future__ import annotations

from pathlib import Path

import junitparser
import pytest
import xmlschema

from meshcone.gates.formats.junit import to_junit
from meshcone.gates.results import GateRun
from tests.unit.gates.runs import MIXED, OPPOSED, asset, warned

SCHEMA = xmlschema.XMLSchema(Path(__file__).with_name("junit.xsd"))


def suites(run: GateRun) -> dict[str, junitparser.TestSuite]:
    return {suite.name: suite for suite in junitparser.JUnitXml.fromstring(to_junit(run))}


def test_it_is_valid() -> None:
    SCHEMA.validate(to_junit(MIXED).decode())


def test_the_schema_would_notice() -> None:
    with pytest.raises(xmlschema.XMLSchemaValidationError):
        SCHEMA.validate(to_junit(MIXED).decode().replace("classname", "class"))


def test_an_asset_is_a_suite_and_a_bound_a_case() -> None:
    found = suites(MIXED)

    assert len(found) == len(MIXED.assets)
    assert [case.name for case in found["good.obj"]] == ["emd/max", "chamfer/max"]
    assert found["good.obj"].time == 0.25


def test_only_what_exceeds_a_bound_is_a_failure() -> None:
    whole = junitparser.JUnitXml.fromstring(to_junit(MIXED))
    [case] = [each for each in suites(MIXED)["bad one.obj"] if not each.is_passed]

    assert whole.failures == 1
    assert [suite.failures for suite in whole] == [0, 1, 0, 0, 0, 0]
    assert isinstance(case.result[0], junitparser.Failure)
    assert case.result[0].message == "emd fail <&>"


def test_a_warning_passes_with_a_note() -> None:
    _, warned = suites(MIXED)["warned.obj"]

    assert warned.is_passed
    assert warned.system_out == "warning: chamfer fail <&>"


def test_what_a_report_warns_of_is_the_output_of_the_suite() -> None:
    written = to_junit(GateRun.of([warned("ball.obj", OPPOSED)]))

    SCHEMA.validate(written.decode())
    [suite] = junitparser.JUnitXml.fromstring(written)
    assert suite.tests == 1
    said = suite._elem.findtext("system-out")
    assert said == "warning: normals.opposed: Most normals <oppose> each other."


def test_an_asset_that_no_gate_applies_to_is_an_error() -> None:
    written = to_junit(GateRun.of([asset("ball.obj")]))

    SCHEMA.validate(written.decode())
    [suite] = junitparser.JUnitXml.fromstring(written)
    [case] = suite
    assert (suite.tests, suite.errors) == (1, 1)
    assert (case.name, case.result[0].type) == ("gated", "not_tested")
    assert case.result[0].message == "No gate applies to this asset."


def test_what_could_not_be_tested_is_no_pass() -> None:
    strict, lenient = suites(MIXED)["open.obj"]

    assert isinstance(strict.result[0], junitparser.Error)
    assert isinstance(lenient.result[0], junitparser.Skipped)


def test_a_file_that_could_not_be_used_is_an_error_and_says_why() -> None:
    [case] = suites(MIXED)["cut\N{REPLACEMENT CHARACTER}.glb"]

    assert case.name == "usable"
    assert case.result[0].type == "input"
    assert case.result[0].message == "cut.glb: the file ends too early"


def test_the_counts_are_those_of_the_cases() -> None:
    whole = junitparser.JUnitXml.fromstring(to_junit(MIXED))
    stated = (whole.tests, whole.failures, whole.errors)

    whole.update_statistics()

    assert stated == (whole.tests, whole.failures, whole.errors) == (10, 1, 3)


def test_a_label_is_part_of_the_name() -> None:
    whole = junitparser.JUnitXml.fromstring(to_junit(GateRun.of(MIXED.assets, "nightly")))

    assert whole.name == "meshcone gate: nightly"
