"""JUnit XML: a test suite for each asset, a test case for each bound.

There is no standard. This keeps to what the schema of Jenkins' xUnit plugin (``junit-10.xsd``)
allows, which GitLab, GitHub actions and Azure Pipelines read too.
"""

from __future__ import annotations

from xml.etree import ElementTree as ET

from meshcone.gates.records import GateCheck
from meshcone.gates.results import NO_GATE, AssetResult, GateRun
from meshcone.text import as_line


def to_junit(run: GateRun) -> bytes:
    """Write a run as JUnit XML.

    A bound that is exceeded is a ``failure``; one that could not be tested, a file that could
    not be used, or an asset that no gate applies to, is an ``error``. A warning leaves its test
    case passed, with a note; one that could not be tested is ``skipped``. What the report warns
    of is the output of the suite.
    """
    name = "meshcone gate" if run.label is None else f"meshcone gate: {run.label}"
    suites = ET.Element("testsuites", {"name": _printable(name)})
    for asset in run.assets:
        _add_suite(suites, asset)
    for count in ("tests", "failures", "errors"):
        suites.set(count, str(sum(int(suite.get(count, 0)) for suite in suites)))
    suites.set("time", _seconds(sum(asset.seconds for asset in run.assets)))
    ET.indent(suites)
    text = ET.tostring(suites, encoding="unicode")
    return f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'.encode()


def _add_suite(suites: ET.Element, asset: AssetResult) -> None:
    suite = ET.SubElement(suites, "testsuite", {"name": _printable(asset.name)})
    for check in asset.checks():
        _fill(_add_case(suite, asset, check.rule), check)
    if asset.is_ungated:
        _add_finding(_add_case(suite, asset, "gated"), "error", "not_tested", NO_GATE)
    if asset.error is not None:
        case = _add_case(suite, asset, "usable")
        _add_finding(case, "error", asset.error.kind, asset.error.message)
    suite.set("tests", str(len(suite.findall("testcase"))))
    for name, tag in (("failures", "failure"), ("errors", "error"), ("skipped", "skipped")):
        suite.set(name, str(len(suite.findall(f"testcase/{tag}"))))
    suite.set("time", _seconds(asset.seconds))
    if asset.warnings:
        text = "\n".join(_printable(f"warning: {each}") for each in asset.warnings)
        ET.SubElement(suite, "system-out").text = text


def _add_case(suite: ET.Element, asset: AssetResult, name: str) -> ET.Element:
    return ET.SubElement(
        suite,
        "testcase",
        {"name": _printable(name), "classname": _printable(asset.name), "time": "0"},
    )


def _fill(case: ET.Element, check: GateCheck) -> None:
    is_error = check.severity == "error"
    if check.status == "fail" and is_error:
        _add_finding(case, "failure", check.bound, check.words)
    elif check.status == "not_tested":
        _add_finding(case, "error" if is_error else "skipped", "not_tested", check.words)
    else:
        prefix = "warning: " if check.status == "fail" else ""
        ET.SubElement(case, "system-out").text = _printable(prefix + check.words)


def _add_finding(case: ET.Element, tag: str, kind: str, words: str) -> None:
    finding = ET.SubElement(case, tag, {"message": _printable(words)})
    if tag != "skipped":
        finding.set("type", kind)
    finding.text = _printable(words)


def _seconds(value: float) -> str:
    return f"{value:.3f}"


def _printable(text: str) -> str:
    # XML has no way to write most control characters (XML 1.0, production 2), and file names do.
    return as_line(text, "\N{REPLACEMENT CHARACTER}")
