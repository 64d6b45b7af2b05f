"""Forged certificates fail, each with a line that says why.

Source and reference are honest; report, certificate and refined file are made to agree.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from meshcone.certificate.checks import Check, Verification
from meshcone.files import MeshFile
from meshcone.options import Options, parse_options
from meshcone.surface.arrays import Floats
from meshcone.surface.similarity import similarity
from meshcone.verbs.verify import verify
from tests.unit.certificate.forging import Forgery, anywhere
from tests.unit.engine.evidence import Evidence
from tests.unit.engine.pairs import RADIUS, rough, smooth

NAN = float("nan")
FAST: dict[str, Any] = {"effort": "fast"}


@pytest.fixture(scope="module")
def honest() -> Evidence:
    return Evidence.of(rough(), smooth(), FAST)


def failures(evidence: Evidence) -> dict[str, str]:
    return {check.name: check.words for check in checks_of(evidence) if not check.ok}


def checks_of(evidence: Evidence) -> tuple[Check, ...]:
    return verification(evidence).checks


def verification(evidence: Evidence) -> Verification:
    stored = MeshFile("certificate.npz", evidence.certificate.to_bytes())
    return verify(evidence.report, stored, evidence.source, evidence.reference, evidence.refined)


def test_a_start_of_the_last_round_far_from_the_source_fails(honest: Evidence) -> None:
    blown_up = Forgery(FAST, before=lambda pair: 25 * pair.source.vertices).of(honest)

    failed = failures(blown_up)

    assert failed.keys() == {"road"}
    assert "24 of the radius away from the source" in failed["road"]


def test_a_weight_that_keeps_any_start_where_it_is_fails(honest: Evidence) -> None:
    options = {**FAST, "surface": {"proximity": 1e6, "edge_cap": 1e6}}

    failed = failures(Forgery(options, before=anywhere).of(honest))

    assert failed.keys() == {"settings"}
    assert "SURFACE.PROXIMITY=1000000.0" in failed["settings"]
    assert "SURFACE.EDGE_CAP=1000000.0" in failed["settings"]
    assert "surface.proximity from 0.0001 to 1;" in failed["settings"]


def test_an_alignment_that_shrinks_the_source_to_a_point_fails(honest: Evidence) -> None:
    onto_a_point = similarity(np.eye(3), 1e-9, np.zeros(3), np.array([RADIUS, 0.0, 0.0]))
    forged = Forgery(
        {**FAST, "align": "similarity"},
        optimum=lambda _, final: np.array([1.0, 0, 0]) + 1e-9 * scattered(final.before),
        motion=onto_a_point,
    ).of(honest)

    failed = failures(forged)

    assert {"placed", "feasible"} <= failed.keys()
    assert "which makes it 1.1e-09 times as large as the reference" in failed["placed"]


def test_an_optimum_blown_up_by_a_tiny_regularization_fails(honest: Evidence) -> None:
    forged = Forgery(
        {"formulation": "centroid", "centroid": {"regularization": 1e-6, "edge_cap": 1e6}},
        optimum=lambda _, final: (
            final.objective.unconstrained_optimum() + 1e-6 * scattered(final.before)  # type: ignore[attr-defined]
        ),
        round_index=0,
    ).of(honest)

    failed = failures(forged)

    assert {"settings", "stationary"} <= failed.keys()
    assert "CENTROID.REGULARIZATION=1e-06" in failed["settings"]
    assert "allowed 2e-09" in failed["stationary"]


def scattered(like: Floats) -> Floats:
    return np.random.default_rng(2).normal(size=like.shape)


def test_a_forgery_is_said_to_prove_how_far_it_is_off_and_nothing_else(honest: Evidence) -> None:
    options = {**FAST, "surface": {"proximity": 1e6, "edge_cap": 1e6}}
    far = verification(Forgery(options, before=anywhere).of(honest))
    blown_up = verification(Forgery(FAST, before=lambda pair: 25 * pair.source.vertices).of(honest))

    assert far.proven.startswith("every point within 4.63 units of the reference")
    assert far.proven.endswith("; that the refined file is an optimum: not proven")
    assert blown_up.proven.endswith("the optimum of its last round; its rounds: not proven")


def test_an_honest_refinement_is_said_to_be_the_optimum_of_its_last_round(
    honest: Evidence,
) -> None:
    words = verification(honest).proven

    assert "; the refined file is the optimum of its last round; round 5 starts" in words


def test_a_first_round_that_starts_elsewhere_fails(honest: Evidence) -> None:
    forged = Forgery(FAST, before=lambda pair: 1.001 * pair.source.vertices, round_index=0)

    assert "the only round starts" in failures(forged.of(honest))["road"]


@pytest.mark.parametrize(
    "motion",
    [
        similarity(np.eye(3), 30.0, np.zeros(3), np.zeros(3)),
        similarity(np.eye(3), 0.5, np.zeros(3), np.zeros(3)),
        similarity(np.eye(3), 1.0, np.zeros(3), np.array([1.0, 0, 0])),
    ],
)
def test_an_alignment_that_brings_the_source_no_closer_fails(
    honest: Evidence, motion: Floats
) -> None:
    forged = Forgery({**FAST, "align": "similarity"}, motion=motion).of(honest)

    assert "placed" in failures(forged)


def test_an_alignment_whose_distances_are_invented_fails() -> None:
    aligned = Evidence.of(rough(), smooth(), {**FAST, "align": "similarity"})
    stated = aligned.report.alignment
    assert stated is not None
    better = stated.model_copy(update={"after": 0.5 * stated.after})
    worse = stated.model_copy(update={"before": 2 * stated.before})
    neither = stated.model_copy(update={"after": NAN})

    assert failures(aligned) == {}
    for invented in (better, worse, neither):
        failed = failures(aligned.with_report(alignment=invented))
        assert "where the report says" in failed["placed"]


@pytest.mark.parametrize("value", [{"mean": 1e-4}, {"max": 1e-4}, {"max": NAN}])
def test_a_displacement_that_is_invented_fails(honest: Evidence, value: dict[str, float]) -> None:
    invented = honest.report.displacement.model_copy(update=value)

    assert failures(honest.with_report(displacement=invented)).keys() == {"displacement"}


@pytest.mark.parametrize("factor", [0.5, NAN])
@pytest.mark.parametrize("name", ["mean", "rms", "p95", "max"])
def test_a_distance_that_is_invented_fails(honest: Evidence, name: str, factor: float) -> None:
    quality = honest.report.quality
    assert quality.refined is not None
    distances = quality.refined.point_to_surface
    invented = distances.model_copy(update={name: factor * getattr(distances, name)})
    refined = quality.refined.model_copy(update={"point_to_surface": invented})
    forged = honest.with_report(quality=quality.model_copy(update={"refined": refined}))

    assert f"point_to_surface.{name}" in failures(forged)["metrics"]


@pytest.mark.parametrize(
    ("path", "value", "failed"),
    [
        ("frame.radius", 3.0, "frame"),
        ("frame.centre", (1.0, 0.0, 0.0), "frame"),
        ("inputs.source.bytes", 1, "inputs"),
        ("inputs.source.faces", 1, "inputs"),
        ("inputs.reference.vertices", 1, "inputs"),
        ("inputs.reference.format", "glb", "inputs"),
        ("output.bytes", 1, "output"),
    ],
)
def test_what_the_report_says_of_its_files_is_held_against_them(
    honest: Evidence, path: str, value: object, failed: str
) -> None:
    *sections, name = path.split(".")
    edited = honest.report.model_copy(deep=True)
    section: Any = edited
    for each in sections:
        section = getattr(section, each)
    section.__dict__[name] = value  # which nothing else allows

    assert failures(replace(honest, report=edited)).keys() == {failed}


def test_a_report_of_another_version_than_the_certificate_fails(honest: Evidence) -> None:
    assert failures(honest.with_report(version="9.9.9")).keys() == {"version"}


@pytest.mark.parametrize("size", [1e30, 1e200, 1e300])
@pytest.mark.parametrize("array", ["before", "positions", "tension"])
@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # the numbers overflow: that is the point
def test_numbers_too_large_to_reckon_with_fail(honest: Evidence, array: str, size: float) -> None:
    numbers = getattr(honest.certificate, array).copy()
    numbers[3] = size

    assert failures(honest.with_certificate(**{array: numbers}))


def test_a_kind_of_cones_without_any_of_them_fails(honest: Evidence) -> None:
    none = {"edge_cap": (np.empty(0, dtype=np.int64), np.empty((0, 4)))}

    assert honest.certificate.multipliers == {}
    assert failures(honest.with_certificate(multipliers=none)).keys() == {"report"}


def test_source_and_reference_in_each_other_s_place_fail(honest: Evidence) -> None:
    swapped = replace(honest, source=honest.reference, reference=honest.source)

    assert {"closeness", "program"} <= failures(swapped.with_forged_hashes()).keys()


def test_another_setting_in_the_report_fails(honest: Evidence) -> None:
    solver = honest.report.solver.model_copy(update={"candidate": "pulling"})

    assert failures(honest.with_report(solver=solver)).keys() == {"candidate"}


def test_every_option_that_is_not_the_default_is_printed(honest: Evidence) -> None:
    pinned = {"effort": "fast", "cones": {"pin": {"vertices": list(range(60))}}, "seed": 3}

    words = settings_words(honest.with_options(parse_options(pinned)))

    assert words == ('not the defaults: effort="fast", seed=3, cones.pin.vertices=(60 entries)')


def test_options_that_are_all_defaults_are_said_to_be(honest: Evidence) -> None:
    assert settings_words(honest.with_options(Options())) == "every option has its default"


def settings_words(evidence: Evidence) -> str:
    return settings_of(evidence).words


def settings_of(evidence: Evidence) -> Check:
    (check,) = (check for check in checks_of(evidence) if check.name == "settings")
    return check


OUT_OF_RANGE: dict[str, Any] = {
    "surface.tangential": {"surface": {"tangential": 11.0}},
    "surface.fairness": {"surface": {"fairness": [3.0, 301.0]}},
    "surface.reverse": {"surface": {"reverse": 1e-3}},
    "surface.noise_scale": {"surface": {"noise_scale": 1e-3}},
    "surface.reach": {"surface": {"reach": 401.0}},
    "solver.tolerance": {"solver": {"tolerance": 0.01}},
    "centroid.edge_cap": {"formulation": "centroid", "centroid": {"edge_cap": 51.0}},
}


@pytest.mark.parametrize("path", OUT_OF_RANGE)
def test_an_option_far_from_its_default_is_in_capitals(honest: Evidence, path: str) -> None:
    check = settings_of(honest.with_options(parse_options(OUT_OF_RANGE[path])))

    assert not check.ok
    assert f"{path.upper()}=" in check.words
    assert f"{path} from " in check.words


@pytest.mark.parametrize(
    "options",
    [
        {"surface": {"reverse": 0.0, "fairness": [0.0]}},
        {"formulation": "centroid", "surface": {"proximity": 1e6}},
        {"surface": {"proximity": 1.0, "edge_cap": 400.0}, "solver": {"tolerance": 1e-3}},
    ],
)
def test_a_term_that_is_off_or_unused_is_within_range(
    honest: Evidence, options: dict[str, Any]
) -> None:
    assert settings_of(honest.with_options(parse_options(options))).ok
