"""Gates proposed from accepted assets."""

from __future__ import annotations

import tomllib
from functools import cache

import pytest
from hypothesis import given
from hypothesis import strategies as st

from meshcone.errors import InputError
from meshcone.files import MeshFile
from meshcone.gates.files import parse_gate_file
from meshcone.gates.thresholds import Threshold, _rounded, gate_file, thresholds
from meshcone.options import parse_options
from meshcone.report.report import AuditReport, MeasureReport
from meshcone.verbs.audit import audit
from tests import shapes
from tests.unit.gates import reports


@cache
def audited(level: int) -> AuditReport:
    """The audit of a ball of 4 to the power of its level times 8 triangles."""
    file = MeshFile("ball.obj", shapes.obj(*shapes.sphere(level)))
    return audit(file, None, parse_options({"mode": "audit"}))


@cache
def measured(height: float) -> MeasureReport:
    return reports.measured(reports.spiked(height)[0])


def named(proposed: list[Threshold], key: str) -> Threshold:
    [found] = [each for each in proposed if each.key == key]
    return found


def test_a_bound_is_the_value_of_the_asset_that_has_most() -> None:
    proposed = thresholds([("small", audited(0)), ("large", audited(2)), ("middle", audited(1))])

    triangles = named(proposed, "asset.budget.triangles")
    assert (triangles.side, triangles.bound, triangles.asset) == ("max", 128, "large")


def test_a_percentile_leaves_out_those_above_it_and_names_them() -> None:
    accepted = [(f"small {number}", audited(0)) for number in range(9)]

    proposed = thresholds([*accepted, ("large", audited(2))], percentile=90)

    triangles = named(proposed, "asset.budget.triangles")
    assert (triangles.bound, triangles.beyond) == (8, ("large",))
    assert "would fail large" in gate_file(proposed, 10)


def test_what_all_have_alike_says_so() -> None:
    proposed = thresholds([("a", audited(0)), ("b", audited(1))])

    watertight = named(proposed, "asset.geometry.watertight")
    assert (watertight.side, watertight.bound, watertight.asset) == ("equals", True, None)


def test_pairs_are_bounded_by_what_is_proven_of_them_and_by_what_changed() -> None:
    proposed = thresholds([("near", measured(0.01)), ("far", measured(0.1))])

    deviation = named(proposed, "deviation.max")
    assert deviation.asset == "far"
    assert isinstance(deviation.bound, float)
    found = measured(0.1).deviation
    assert found is not None
    assert found.max.upper <= deviation.bound <= 1.01 * found.max.upper
    assert named(proposed, "changes.lost.materials").bound == 0


def test_every_accepted_asset_passes_the_gates_proposed_from_all() -> None:
    heights = (0.01, 0.05, 0.1)
    text = gate_file(thresholds([(str(h), measured(h)) for h in heights]), len(heights))

    file = parse_gate_file("gates.toml", text.encode(), "measure")
    gates = {key: dict(rule.bounds()) for key, rule in file.for_asset("any").items()}
    for height in heights:
        report = reports.measured(reports.spiked(height)[0], gates)
        assert report.gates is not None
        failed = [check.key for check in report.gates.checks if check.status == "fail"]
        assert failed == []


def test_names_of_assets_cannot_break_the_file() -> None:
    text = gate_file(thresholds([("a\nb\x1b = 1 #", audited(0)), ("c", audited(1))]), 2)

    assert set(tomllib.loads(text)) == {"gates"}


@pytest.mark.parametrize("percentile", [49.9, 100.1, float("nan")])
def test_a_percentile_out_of_range_is_refused(percentile: float) -> None:
    with pytest.raises(InputError, match="from 50 to 100"):
        thresholds([("a", audited(0))], percentile)


def test_no_asset_is_refused() -> None:
    with pytest.raises(InputError, match="no accepted asset"):
        thresholds([])


@given(st.floats(1e-9, 1e9))
def test_a_bound_is_rounded_away_from_its_asset_and_not_far(value: float) -> None:
    assert value <= _rounded(value, "max") <= 1.011 * value
    assert 0.989 * value <= _rounded(value, "min") <= value
