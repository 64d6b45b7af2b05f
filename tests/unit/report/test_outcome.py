"""The word for a refinement, and the rule behind it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.program.answer import RefinedPositions
from meshcone.quality.harm import Gain
from meshcone.quality.records import Metrics, PointToSurface
from meshcone.report.outcome import decide_agreement, decide_outcome
from meshcone.report.report import Outcome
from meshcone.report.scoring import Scorer
from meshcone.verbs.measure import measure
from tests import shapes
from tests.meshes import sphere

SAMPLES = 5000
NOWHERE = np.zeros((1, 3))
SOLVED = RefinedPositions(NOWHERE, [], None)
COPIED = RefinedPositions(NOWHERE, [], None, copied_reference=True)
KEPT = RefinedPositions(NOWHERE, [], None, kept_because=("the largest distance grows",))
MISALIGNED = RefinedPositions(NOWHERE, [], None, misaligned="They lie apart.")
BALL = Scorer(sphere(2), sphere(2), parse_options({"quality": {"emd_samples": 32}}))


def at(mean: float, spread: float = 0.0) -> Metrics:
    """Metrics with a mean distance and the standard deviation of the distances behind it."""
    rms = (mean**2 + spread**2) ** 0.5
    distances = PointToSurface(mean=mean, rms=rms, p95=mean, max=mean, max_at=(0, 0, 0))
    return BALL.floor.model_copy(update={"point_to_surface": distances})


@pytest.mark.parametrize(
    ("before", "after", "move", "solved", "expected"),
    [
        pytest.param(at(0.1), at(0.05), 0.1, COPIED, "reference_copy", id="anchored at it"),
        pytest.param(at(0.0), at(0.0), 0.0, SOLVED, "indistinguishable", id="the reference"),
        pytest.param(at(3e-8), at(6e-8), 1e-3, SOLVED, "indistinguishable", id="but for rounding"),
        pytest.param(at(9.0), at(9.0), 0.0, MISALIGNED, "misaligned", id="elsewhere"),
        pytest.param(at(0.0), at(0.0), 0.0, MISALIGNED, "misaligned", id="inside out"),
        pytest.param(at(0.1), at(0.1), 0.0, KEPT, "kept", id="nothing was better"),
        pytest.param(at(0.0), at(0.0), 0.0, KEPT, "indistinguishable", id="nothing to gain"),
        pytest.param(at(0.1), at(0.1), 1e-8, SOLVED, "unchanged", id="did not move"),
        pytest.param(at(0.1), at(0.05), 0.1, SOLVED, "improved", id="closer"),
        pytest.param(at(0.05), at(0.1), 0.1, SOLVED, "worse", id="farther"),
        pytest.param(at(0.0), at(1e-3), 0.1, SOLVED, "worse", id="left the reference"),
    ],
)
def test_outcomes(
    before: Metrics, after: Metrics, move: float, solved: RefinedPositions, expected: Outcome
) -> None:
    found = decide_outcome(before, after, BALL.floor, SAMPLES, move, solved)

    assert found == expected


def test_a_difference_within_two_standard_errors_is_none() -> None:
    # Of each mean: 0.1 over the root of 2 · 5,000 samples, 0.001; of the difference: 0.0014.
    before = at(0.1, spread=0.1)

    within = decide_outcome(before, at(0.0973, 0.1), BALL.floor, SAMPLES, 0.1, SOLVED)
    beyond = decide_outcome(before, at(0.0970, 0.1), BALL.floor, SAMPLES, 0.1, SOLVED)

    assert (within, beyond) == ("undecided", "improved")


@pytest.mark.parametrize(
    ("gain", "after", "expected"),
    [
        pytest.param(Gain(2e-3, 1e-4), 0.098, "improved", id="the same places came closer"),
        pytest.param(Gain(2e-3, 2e-3), 0.098, "undecided", id="some came closer, some did not"),
        pytest.param(Gain(2e-3, 1e-4), 0.101, "undecided", id="the metric says otherwise"),
        pytest.param(Gain(-2e-3, 1e-4), 0.102, "worse", id="the same places are farther away"),
    ],
)
def test_the_same_places_before_and_after_decide_what_independent_samples_cannot(
    gain: Gain, after: float, expected: Outcome
) -> None:
    # A part that the reference lacks: distances of it vary a hundred times as much as what changes.
    before, solved = at(0.1, spread=0.3), replace(SOLVED, gain=gain)

    assert decide_outcome(before, at(after, 0.3), BALL.floor, SAMPLES, 0.1, solved) == expected


def test_a_mesh_can_be_told_from_its_reference_above_the_floor() -> None:
    assert decide_agreement(BALL.input, BALL.floor, is_opposed=False) == "indistinguishable"
    assert decide_agreement(at(1e-5), BALL.floor, is_opposed=False) == "different"


def test_a_mesh_turned_inside_out_can_be_told_from_its_reference() -> None:
    vertices, faces = shapes.sphere(2)
    ball = MeshFile("ball.obj", shapes.obj(vertices, faces))
    turned = MeshFile("turned.obj", shapes.obj(vertices, faces[:, ::-1]))

    assert measure(turned, ball, parse_options({"mode": "measure"})).outcome == "different"


def test_a_part_that_is_small_and_astray_is_told_from_rounding() -> None:
    far = at(0.0).point_to_surface.model_copy(update={"max": 0.4})
    found = at(0.0).model_copy(update={"point_to_surface": far})

    assert decide_agreement(found, BALL.floor, is_opposed=False) == "different"
    assert decide_outcome(found, found, BALL.floor, SAMPLES, 0.0, SOLVED) == "unchanged"


def test_a_refinement_of_what_faces_the_other_way_is_not_indistinguishable() -> None:
    same = at(0.0)

    found = decide_outcome(same, same, BALL.floor, SAMPLES, 0.0, SOLVED, is_opposed=True)

    assert found == "unchanged"
