"""The section of a report, and gates that are decided by it."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.errors import InputError
from meshcone.files import MeshFile
from meshcone.gates.judge import judge
from meshcone.gates.records import GateCheck
from meshcone.gates.rules import GateRule
from meshcone.options import parse_options
from meshcone.report.report import MeasureReport
from meshcone.verbs.measure import measure
from meshcone.verbs.refine import refine
from tests import shapes
from tests.unit.gates.reports import QUICK, RADIUS, measured, reference, refined, spiked

DEPTH = 0.2  # of the hidden fold, in model units


def hidden_fold() -> MeshFile:
    """The ball with one small face under its surface, on which no vertex is the farthest."""
    vertices, faces = shapes.sphere(3, RADIUS)
    fold = vertices[faces[100]] * (1 - DEPTH / RADIUS)
    faces = np.concatenate([faces, len(vertices) + np.array([[0, 1, 2]])])
    return MeshFile("folded.obj", shapes.obj(np.concatenate([vertices, fold]), faces))


def flat(steps: int, name: str, height: float = 0.0) -> MeshFile:
    """The unit square, its middle pulled up by a height."""
    side = np.linspace(0, 1, steps + 1)
    vertices = np.array([(x, y, 0.0) for x in side for y in side])
    vertices[len(vertices) // 2, 2] = height
    corner = np.arange(steps * (steps + 1)).reshape(steps, steps + 1)[:, :-1].ravel()
    a, b, c, d = corner, corner + 1, corner + steps + 2, corner + steps + 1
    faces = np.concatenate([np.stack([a, c, b], 1), np.stack([a, d, c], 1)])
    return MeshFile(name, shapes.obj(vertices, faces))


def measure_quickly(source: MeshFile, other: MeshFile, **options: object) -> MeasureReport:
    parsed = parse_options({"mode": "measure", **options})
    return measure(source, other, parsed.model_copy(update={"quality": QUICK}))


def only_check(report: MeasureReport) -> GateCheck:
    assert report.gates is not None
    (check,) = report.gates.checks
    return check


def test_the_larger_direction_is_the_deviation_of_both() -> None:
    found = measured(spiked(0.1)[0]).deviation
    assert found is not None
    assert found.max.lower == max(found.extra.lower, found.missing.lower)
    assert found.max.upper == max(found.extra.upper, found.missing.upper)
    assert found.extra.proven
    assert found.extra.width == found.extra.upper - found.extra.lower <= 1e-4


def test_it_is_in_model_units_too_with_the_place() -> None:
    source, spike = spiked(0.1)
    found = measured(source).deviation
    assert found is not None
    assert found.extra.lower_model <= 0.1 <= found.extra.upper_model + 1e-8
    assert found.extra.upper_model == pytest.approx(0.1, abs=3e-4)
    np.testing.assert_allclose(found.extra.at, spike, atol=1e-8)


def test_what_the_mesh_lacks_is_missing_and_not_extra() -> None:
    whole, hole = flat(4, "whole.obj"), flat(4, "hole.obj")
    lines = hole.data.splitlines(keepends=True)
    report = measure_quickly(MeshFile("hole.obj", b"".join(lines[:-8])), whole)
    assert report.deviation is not None
    assert report.deviation.extra.upper == 0
    assert report.deviation.missing.lower > 0.1


def test_no_sample_is_beyond_what_is_proven() -> None:
    report = refined()
    assert report.deviation is not None
    assert report.quality.refined is not None
    assert report.quality.refined.point_to_surface.max <= report.deviation.max.upper


def test_a_refinement_is_proven_of_the_file_that_was_written() -> None:
    report = refined()
    assert report.deviation is not None
    before = measured(MeshFile("rough.obj", shapes.obj(shapes.noisy(shapes.sphere(2, 2.0)[0]),
                               shapes.sphere(2)[1])))  # fmt: skip
    assert before.deviation is not None
    assert report.deviation.extra.upper < before.deviation.extra.lower


def test_the_statement_rounds_up() -> None:
    report = measured(spiked(0.1)[0])
    assert report.deviation is not None
    assert report.statement is not None
    stated = float(report.statement.split()[3])
    assert report.deviation.extra.upper_model <= stated <= 1.01 * report.deviation.extra.upper_model
    assert report.statement.endswith("units (proven)")


def test_a_gate_names_the_unit_of_the_statement() -> None:
    report = measured(spiked(0.1)[0], {"deviation.max": {"max_model": 1.0, "unit": "mm"}})
    assert report.statement is not None
    assert " mm of the reference" in report.statement


def test_the_unit_of_gltf_is_the_metre() -> None:
    ball = MeshFile("ball.glb", shapes.glb(*shapes.sphere(2)))
    report = measure_quickly(ball, ball)
    assert report.statement == (
        "every point within 0 m of the reference, every point of the reference within 0 m (proven)"
    )


def test_nothing_is_proven_where_nobody_asks() -> None:
    report = measure_quickly(reference(), reference(), deviation={"prove": False})
    assert report.deviation is None
    assert report.statement is None


def test_a_gate_fails_on_what_no_vertex_shows() -> None:
    """The fold's own vertices are under a face each: samples of it are few."""
    report = measured(hidden_fold(), {"deviation.extra": {"max_model": 0.9 * DEPTH, "unit": "mm"}})
    check = only_check(report)
    assert check.status == "fail"
    assert check.position is not None
    assert np.linalg.norm(check.position) < RADIUS - 0.8 * DEPTH
    assert check.words.startswith(
        "proven distance that the mesh goes beyond the reference at least"
    )


def test_a_gate_passes_only_where_the_upper_end_is_within() -> None:
    check = only_check(measured(spiked(0.1)[0], {"deviation.max": {"max_model": 0.11}}))
    assert check.status == "pass"
    assert isinstance(check.value, float)
    assert 0.1 - 1e-8 <= check.value <= 0.11
    assert "at most" in check.words


def test_a_gate_is_decided_however_close_the_bound_is() -> None:
    """The search goes beyond the width that was asked for."""
    for bound, status in ((0.05 * (1 - 1e-6), "fail"), (0.05 * (1 + 1e-6), "pass")):
        report = measured(spiked(0.1)[0], {"deviation.max": {"max": bound}})
        assert only_check(report).status == status


def test_what_cannot_be_decided_is_not_tested() -> None:
    source, other = flat(6, "bent.obj", height=0.3), flat(5, "flat.obj", height=0.1)
    gates = {"deviation.max": {"max": 0.2}}
    known = measure_quickly(source, other).deviation
    assert known is not None
    middle = (known.max.lower + known.max.upper) / 2
    gates = {"deviation.max": {"max": middle}}
    report = measure_quickly(source, other, gates=gates, deviation={"pieces": 0})
    assert report.deviation is not None
    assert not report.deviation.max.proven
    assert only_check(report).status == "not_tested"
    assert "not decided within `deviation.pieces`" in only_check(report).words


@pytest.mark.parametrize("bound", ["max", "max_model"])
@pytest.mark.parametrize(
    ("name", "status"), [("deviation.max", "not_tested"), ("deviation.max.upper", "fail")]
)
def test_nothing_proven_is_forgiven_as_rounding(name: str, status: str, bound: str) -> None:
    gates: dict[str, object] = {name: {bound: 1e-12}}
    report = measured(spiked(5e-10 * RADIUS)[0], gates)
    assert report.deviation is not None
    assert report.deviation.max.lower < 1e-12 < report.deviation.max.upper < 1e-9
    assert only_check(report).status == status


def test_a_gate_on_one_end_has_the_interval_as_narrow_as_asked() -> None:
    report = measured(spiked(0.1)[0], {"deviation.max.upper": {"max": 0.06}})
    assert report.deviation is not None
    assert report.deviation.max.width <= 1e-4
    assert only_check(report).status == "pass"


@pytest.mark.parametrize(
    ("rule", "words"),
    [
        ({"max_ratio_to_floor": 1.0}, "for metrics"),
        ({"equals": True}, "words and yes-or-no values"),
        ({"one_of": ("a",)}, "words"),
    ],
)
def test_bounds_that_no_interval_can_have_are_refused(rule: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        measured(reference(), {"deviation.max": rule})


def test_a_report_without_the_section_passes_no_gate_on_it() -> None:
    report = measure_quickly(reference(), reference(), deviation={"prove": False})
    verdict = judge(report, {"deviation.max": GateRule(max=1.0)})
    assert verdict.verdict == "not_tested"


def test_a_required_distance_is_decided_by_the_lower_end() -> None:
    report = measured(spiked(0.1)[0], {"deviation.extra": {"min_model": 0.09}})
    assert only_check(report).status == "pass"
    assert only_check(measured(reference(), {"deviation.extra": {"min": 0.1}})).status == "fail"


def test_a_refinement_that_kept_its_input_is_proven_too() -> None:
    """Without rounds the file that is written is the file that came."""
    options = parse_options({"surface": {"fairness": []}}).model_copy(update={"quality": QUICK})
    report = refine(spiked(0.1)[0], reference(), options).report
    assert report.deviation is not None
    assert report.deviation.extra.upper_model == pytest.approx(0.1, abs=3e-4)


def test_a_spike_is_beyond_a_tolerance_on_a_small_share_of_the_area() -> None:
    rule = {"tolerance_model": 0.02, "max": 0.05, "unit": "mm"}
    report = measured(spiked(0.1)[0], {"deviation.area_beyond": rule})
    assert report.deviation is not None
    found = report.deviation.area_beyond
    assert found is not None
    assert found.tolerance == pytest.approx(0.02 / RADIUS)
    assert 0 < found.upper <= 0.05
    assert only_check(report).status == "pass"


def test_too_much_area_beyond_a_tolerance_fails() -> None:
    rule = {"tolerance_model": 0.02, "max": 0.0001}
    check = only_check(measured(spiked(0.1)[0], {"deviation.area_beyond": rule}))
    assert check.status == "fail"
    assert check.words.startswith("share of the area beyond the tolerance at least 0.0")


@pytest.mark.parametrize(
    ("key", "rule", "words"),
    [
        ("deviation.area_beyond", {"max": 0.1}, "needs one of tolerance"),
        ("deviation.area_beyond", {"max": 0.1, "tolerance": 1.0, "tolerance_model": 1.0}, "one of"),
        ("deviation.area_beyond", {"max_model": 0.1, "tolerance": 1.0}, "for distances"),
        ("deviation.area_beyond.extra", {"max": 0.1}, "the gate that has a tolerance"),
        ("deviation.max", {"max": 0.1, "tolerance": 1.0}, "a tolerance is for"),
    ],
)
def test_a_tolerance_belongs_to_the_area_beyond_it(
    key: str, rule: dict[str, object], words: str
) -> None:
    with pytest.raises(InputError, match=words):
        measured(reference(), {key: rule})


def test_a_spike_is_outside_of_a_closed_reference() -> None:
    source, spike = spiked(0.1)
    found = measured(source, {"deviation.inside": {"max": 0.01}}).deviation
    assert found is not None
    assert found.outside is not None
    assert found.inside is not None
    assert found.outside.upper_model == pytest.approx(0.1, abs=3e-4)
    assert found.outside.at is not None
    np.testing.assert_allclose(found.outside.at, spike, atol=1e-8)
    assert found.inside.lower == 0
    assert found.inside.upper < 0.02  # where the spike meets the ball, its side is not known


def test_an_open_reference_has_no_sides() -> None:
    found = measure_quickly(flat(3, "bent.obj", height=0.3), flat(4, "flat.obj")).deviation
    assert found is not None
    assert found.outside is None
    assert found.inside is None
