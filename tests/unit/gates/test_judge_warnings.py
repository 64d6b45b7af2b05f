"""Gates of warnings: what is counted, and what was not looked for."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.report.report import MeasureReport
from meshcone.verbs.audit import audit
from meshcone.verbs.measure import measure
from tests import shapes
from tests.unit.gates.reports import QUICK, RADIUS, check, measured, reference, spiked

HEIGHT = 0.2  # model units


@pytest.fixture(scope="module")
def report() -> MeasureReport:
    """A ball with a spike, measured."""
    return measured(spiked(HEIGHT)[0])


def test_warnings_are_counted_by_code_by_family_and_all_together() -> None:
    vertices, faces = shapes.sphere(3, RADIUS)
    report = measured(MeshFile("inside_out.obj", shapes.obj(vertices, faces[:, ::-1])))

    code = check(report, "warnings.normals.opposed", max=0)
    assert (code.status, code.value, code.path) == ("fail", 1, "warnings")
    assert "number of warnings 'normals.opposed' 1, allowed 0: normals.opposed: 100 %" in code.words
    assert check(report, "warnings.normals", max=0).value == 1
    assert check(report, "warnings", max=0).value == len(report.warnings)


def test_a_warning_that_is_not_there_counts_nothing(report: MeasureReport) -> None:
    found = check(report, "warnings.normals.opposed", max=0)

    assert (found.status, found.value) == ("pass", 0)


def measured_with(source: MeshFile, **options: object) -> MeasureReport:
    quick = {"samples": 200, "emd_samples": 16, "curvature_samples": 16}
    parsed = parse_options({"mode": "measure", "quality": {**quick, **options}})
    return measure(source, reference(), parsed)


@pytest.mark.parametrize("key", ["warnings.faces.crossing", "warnings.faces", "warnings"])
def test_no_gate_passes_on_crossings_that_nobody_counted(key: str) -> None:
    uncounted = measured_with(reference(), intersection_pairs=1)

    found = check(uncounted, key, max=0)

    assert check(uncounted, "validity.self_intersections", max=0).status == "not_tested"
    assert (found.status, found.value) == ("not_tested", None)
    assert found.words.endswith("not tested, because this run did not look for 'faces.crossing'")
    assert check(uncounted, "warnings.edges", max=0).status == "pass"
    assert check(measured_with(reference()), key, max=0).status == "pass"


def test_warnings_that_were_not_looked_for_could_only_add_to_a_number() -> None:
    vertices, faces = shapes.sphere(3, RADIUS)
    twice = MeshFile("twice.obj", shapes.obj(vertices, np.vstack([faces, faces[:1]])))
    uncounted = measured_with(twice, intersection_pairs=1)
    count = len([each for each in uncounted.warnings if each.code.startswith("faces.")])

    assert count > 0
    assert check(uncounted, "warnings.faces", max=count - 1).status == "fail"
    assert check(uncounted, "warnings.faces", max=count).status == "not_tested"
    assert check(uncounted, "warnings.faces", min=count).status == "pass"
    assert check(uncounted, "warnings.faces", min=count + 1).status == "not_tested"


@pytest.mark.parametrize(
    "code",
    ["materials.undefined", "materials.library_missing", "textures.missing", "normals"],
)
def test_no_gate_passes_on_what_an_audit_would_have_seen(code: str) -> None:
    options = parse_options({"mode": "measure", "audit": False})
    unaudited = measure(reference(), reference(), options.model_copy(update={"quality": QUICK}))

    assert check(unaudited, f"warnings.{code}", max=0).status == "not_tested"
    assert check(measured(reference()), f"warnings.{code}", max=0).status == "pass"


def test_without_a_reference_no_gate_passes_on_what_a_pair_would_show() -> None:
    alone = audit(reference(), None, parse_options({"mode": "audit"}))
    beside = audit(reference(), reference(), parse_options({"mode": "audit"}))

    for key in ("warnings.normals.opposed", "warnings.pieces.missing", "warnings.pose"):
        assert check(alone, key, max=0).status == "not_tested"
        assert check(beside, key, max=0).status == "pass"
    assert check(alone, "warnings.colors.not_compared", max=0).status == "not_tested"
    assert check(beside, "warnings.colors.not_compared", max=0).status == "not_tested"


def test_the_number_of_all_warnings_is_of_those_that_the_kind_of_job_looks_for() -> None:
    options = parse_options({"mode": "audit"})

    assert check(audit(reference(), None, options), "warnings", max=0).status == "pass"
    assert check(audit(reference(), reference(), options), "warnings", max=0).status == "pass"


def test_colours_that_nobody_compared_pass_no_gate() -> None:
    off = measured_with(reference(), appearance=False)

    key = "warnings.colors.not_compared"
    assert check(off, key, max=0).status == "not_tested"
    assert check(measured_with(reference()), key, max=0).status == "pass"
