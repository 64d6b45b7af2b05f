"""Verdicts on real reports: what a bound compares, and what it says of it."""

from __future__ import annotations

import pytest

from meshcone.errors import InputError
from meshcone.files import MeshFile
from meshcone.gates.judge import judge
from meshcone.gates.rules import GateRule
from meshcone.gates.units import is_distance
from meshcone.gates.words import point
from meshcone.options import parse_options
from meshcone.quality.conventions import conventions
from meshcone.quality.sampled import Sampling
from meshcone.report.report import MeasureReport, Report
from meshcone.verbs.measure import measure
from tests import shapes
from tests.truck import truck_obj
from tests.unit.gates.reports import RADIUS, check, measured, reference, refined, spiked

HEIGHT = 0.2  # model units


@pytest.fixture(scope="module")
def report() -> MeasureReport:
    """A ball with a spike, measured."""
    return measured(spiked(HEIGHT)[0])


@pytest.fixture(scope="module")
def refinement() -> Report:
    """A rough ball, refined."""
    return refined()


def test_a_bound_is_itself_allowed(report: MeasureReport) -> None:
    worst = report.quality.input.point_to_surface.max

    assert check(report, "point_to_surface.max", max=worst).status == "pass"
    assert check(report, "point_to_surface.max", max=worst * 0.999).status == "fail"
    assert check(report, "point_to_surface.max", min=worst).status == "pass"
    assert check(report, "point_to_surface.max", min=worst * 1.001).status == "fail"


def test_a_bound_in_model_units_is_held_against_the_distance_in_model_units(
    report: MeasureReport,
) -> None:
    found = check(report, "point_to_surface.max", max_model=0.1, unit="mm")

    assert found.status == "fail"
    assert found.value == pytest.approx(HEIGHT, rel=0.01)
    assert (found.limit, found.path) == (0.1, "quality.input.point_to_surface.max")


def test_a_deviation_is_told_with_its_place_and_both_lengths(report: MeasureReport) -> None:
    found = check(report, "point_to_surface.max", max_model=0.1, unit="mm")

    x, y, z = spiked(HEIGHT)[1]
    assert found.position == pytest.approx((x, y, z), abs=1e-6)
    assert found.words == f"worst deviation 0.2 mm near ({x:.4g}, {y:.4g}, {z:.4g}), allowed 0.1 mm"


def test_a_relative_bound_is_told_in_model_units_too(report: MeasureReport) -> None:
    found = check(report, "point_to_surface.max", max=0.05)

    assert found.words.startswith("worst deviation 0.1 of the radius (0.2 units) near (")
    assert found.words.endswith("allowed 0.05 of the radius (0.1 units)")


def test_a_place_is_where_the_reference_is_once_the_source_was_aligned() -> None:
    source, place = spiked(HEIGHT)
    elsewhere = MeshFile("elsewhere.obj", _shifted(source.data, 5.0))

    report = measure(elsewhere, reference(), parse_options({"align": "rigid"}))

    found = check(report, "point_to_surface.max", max=1e-3)
    assert found.position == pytest.approx(tuple(place), abs=0.02)


def _shifted(data: bytes, by: float) -> bytes:
    words = [line.split() for line in data.decode().splitlines()]
    moved = [[k, str(float(x) + by), y, z] if k == "v" else [k, x, y, z] for k, x, y, z in words]
    return "\n".join(map(" ".join, moved)).encode()


def test_numbers_that_differ_are_never_written_alike(report: MeasureReport) -> None:
    fscore = report.quality.input.fscore

    words = check(report, "fscore", min=fscore * (1 + 1e-6)).words

    value, least = words.removeprefix("F-score ").removesuffix(" required").split(", at least ")
    assert float(value) < float(least)


def test_a_ratio_to_the_floor_is_to_what_the_reference_scores(report: MeasureReport) -> None:
    metrics, floor = report.quality.input, report.quality.floor
    ratio = metrics.emd / floor.emd

    assert check(report, "emd", max_ratio_to_floor=ratio * 1.01).status == "pass"
    failed = check(report, "emd", max_ratio_to_floor=ratio * 0.99)
    assert failed.status == "fail"
    assert failed.limit == pytest.approx(ratio * 0.99 * floor.emd)
    assert "the floor" in failed.words


@pytest.mark.parametrize("whose", ["input", "floor"])
def test_a_ratio_to_what_has_no_such_value_is_not_tested(refinement: Report, whose: str) -> None:
    """Before a refinement, nothing has turned a face over."""
    assert refinement.quality.input.validity.flipped_faces is None

    found = check(refinement, "validity.flipped_faces", **{f"max_ratio_to_{whose}": 1})

    assert found.status == "not_tested"
    assert found.words.endswith(f"not tested, because the {whose} has no such value")


@pytest.mark.parametrize("key", ["validity.self_intersections", "validity.cracks"])
def test_points_have_no_floor_of_faces(report: MeasureReport, key: str) -> None:
    """What a report says of a reference of points."""
    floor = report.quality.floor
    counted = {"self_intersections": "not_tested", "cracks": None}
    validity = floor.validity.model_copy(update=counted)
    quality = report.quality.model_copy(
        update={"floor": floor.model_copy(update={"validity": validity})}
    )

    found = check(report.model_copy(update={"quality": quality}), key, max_ratio_to_floor=1)

    assert found.status == "not_tested"


def test_a_multiple_of_a_floor_of_rounding_allows_rounding() -> None:
    same = measured(reference())
    other = measured(spiked(HEIGHT)[0])

    assert check(same, "point_to_surface.mean", max_ratio_to_floor=1).status == "pass"
    assert check(other, "point_to_surface.mean", max_ratio_to_floor=100).status == "fail"


def test_rounding_in_model_units_is_relative_to_the_radius(report: MeasureReport) -> None:
    radius = 1e-9
    tiny = report.model_copy(update={"frame": report.frame.model_copy(update={"radius": radius})})
    distance = report.quality.input.point_to_surface.max * radius

    assert check(tiny, "point_to_surface.max", max_model=distance / 2, unit="m").status == "fail"
    assert check(tiny, "point_to_surface.max", max_model=distance, unit="m").status == "pass"


def test_a_refined_mesh_is_judged_and_not_its_input(refinement: Report) -> None:
    found = check(refinement, "point_to_surface.mean", max_ratio_to_input=0.9)
    after, before = refinement.quality.refined, refinement.quality.input

    assert after is not None
    assert found.status == "pass"
    assert found.path == "quality.refined.point_to_surface.mean"
    assert found.value == after.point_to_surface.mean
    assert found.limit == pytest.approx(0.9 * before.point_to_surface.mean)


def test_any_number_truth_or_word_of_a_report_has_a_gate(refinement: Report) -> None:
    assert check(refinement, "solver.iterations", max=10**6).status == "pass"
    assert check(refinement, "quality.input.emd", max=1e-9).status == "fail"
    assert check(refinement, "certificate.holds", equals=True).status == "pass"
    assert check(refinement, "certificate.active.edge_cap", max=10**6).status == "pass"
    assert check(refinement, "outcome", one_of=["improved", "unchanged"]).status == "pass"
    worse = check(refinement, "outcome", equals="worse")
    assert worse.words == "outcome: 'improved', must be 'worse'"


def test_a_truth_is_told_as_yes_or_no() -> None:
    vertices, faces = shapes.sphere(3, RADIUS)
    open_ball = MeshFile("open.obj", shapes.obj(vertices, faces[:-1]))

    found = check(measured(open_ball), "validity.watertight", equals=True)

    assert (found.status, found.words) == ("fail", "watertight: no, must be yes")


def test_a_value_that_was_not_taken_is_neither_passed_nor_failed(report: MeasureReport) -> None:
    found = check(report, "validity.flipped_faces", max=0)  # nothing it could be flipped from

    assert (found.status, found.value) == ("not_tested", None)
    assert found.words.endswith("not tested")


def test_a_section_the_report_lacks_is_not_tested(report: MeasureReport) -> None:
    found = check(report, "alignment.after", max=1)

    assert (found.status, found.path) == ("not_tested", None)


@pytest.mark.parametrize(
    ("rules", "verdict"),
    [
        ({"emd": {"max": 10}}, "pass"),
        ({"emd": {"max": 0}}, "fail"),
        ({"emd": {"max": 0, "severity": "warning"}}, "pass"),
        ({"validity.flipped_faces": {"max": 0}}, "not_tested"),
        ({"validity.flipped_faces": {"max": 0, "severity": "warning"}}, "pass"),
        ({"validity.flipped_faces": {"max": 0}, "emd": {"max": 0}}, "fail"),
        ({"emd": {"min": 0, "max": 0}}, "fail"),
        ({}, "not_tested"),
    ],
)
def test_a_verdict_is_that_of_its_errors(
    report: MeasureReport, rules: dict[str, object], verdict: str
) -> None:
    gates = {key: GateRule.model_validate(rule) for key, rule in rules.items()}

    assert judge(report, gates).verdict == verdict


def test_every_bound_of_a_rule_is_a_check_of_its_own(report: MeasureReport) -> None:
    verdict = judge(report, {"emd": GateRule(min=0, max=10)})

    assert [each.rule for each in verdict.checks] == ["emd/max", "emd/min"]


def test_the_engine_judges_what_its_options_ask_for() -> None:
    report = measured(spiked(HEIGHT)[0], {"point_to_surface.max": {"max_model": 0.1}})

    assert report.gates is not None
    assert report.gates.verdict == "fail"
    assert report.options.gates["point_to_surface.max"].max_model == 0.1


def test_the_engine_refuses_a_gate_it_does_not_know() -> None:
    with pytest.raises(InputError, match="unknown gate 'fscor'; did you mean 'fscore'"):
        measured(reference(), {"fscor": {"min": 1}})


def test_distances_are_the_metrics_whose_unit_is_the_radius() -> None:
    found = conventions(Sampling(16, 16, 16), 0, 1).metrics

    assert {key for key in found if is_distance(key)} == {
        key for key, convention in found.items() if convention.unit == "radius"
    }


def test_each_direction_has_gates_in_model_units() -> None:
    report = measured(spiked(HEIGHT)[0])

    found = check(report, "quality.directions.extra.max", max_model=0.1)

    assert found.status == "fail"
    assert found.value == pytest.approx(HEIGHT, rel=1e-3)


def test_the_number_of_missing_parts_has_a_gate() -> None:
    options = parse_options({"quality": {"per": "node", "samples": 200, "emd_samples": 16}})
    source = MeshFile("truck.obj", truck_obj(without=["wheel_front_left"]))
    report = measure(source, MeshFile("master.obj", truck_obj()), options)

    assert check(report, "quality.per.missing", max=0).status == "fail"
    assert check(report, "quality.per.extra", max=0).status == "pass"


def test_without_parts_their_gate_is_not_tested(report: MeasureReport) -> None:
    assert check(report, "quality.per.missing", max=0).status == "not_tested"


def test_a_coordinate_that_rounding_left_is_written_as_0() -> None:
    assert point([3.2e-17, 19.58, -5e-17]) == "(0, 19.58, 0)"
    assert point([3.2e-17, -4e-17, 0.0]) == "(3.2e-17, -4e-17, 0)"
