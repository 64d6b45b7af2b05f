"""Refining again gives the same bytes, and unmasks a start that no round led to."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import meshcone
from meshcone.certificate.checks import Check, Verification
from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.verbs.replay import verify_by_replay
from tests import shapes
from tests.meshes import sphere, torus
from tests.unit.certificate.forging import Forgery
from tests.unit.engine.evidence import Evidence
from tests.unit.engine.pairs import CAPPED, rough, smooth

FAST: dict[str, Any] = {"effort": "fast"}


@pytest.fixture(scope="module")
def honest() -> Evidence:
    return Evidence.of(rough(), smooth(), FAST)


def replayed(evidence: Evidence) -> Verification:
    stored = MeshFile("certificate.npz", evidence.certificate.to_bytes())
    return verify_by_replay(
        evidence.report, stored, evidence.source, evidence.reference, evidence.refined
    )


def road(evidence: Evidence) -> Check:
    (check,) = (check for check in replayed(evidence).checks if check.name == "road")
    return check


@pytest.mark.parametrize(
    "options",
    [
        {"effort": "best"},
        CAPPED,
        {"align": "similarity", **FAST},
        {"surface": {"regions": 3}, **FAST},
    ],
)
def test_a_refinement_is_replayed_byte_for_byte(options: dict[str, Any]) -> None:
    verification = replayed(Evidence.of(rough(), smooth(), options))

    assert verification.ok, str(verification)
    assert "every round was solved again" in str(verification)
    assert "not replayed" not in str(verification)


def test_a_start_that_was_stretched_is_replayed() -> None:
    vertices, faces = shapes.sphere(3)
    lengthened = shapes.obj(vertices * np.array([1.0, 0.2, 0.2]), faces)
    reference = MeshFile("lengthened.obj", lengthened)

    found = Evidence.of(MeshFile("ball.obj", shapes.obj(vertices, faces)), reference, {})

    assert found.report.solver.candidate == "stretching"
    assert found.report.outcome == "improved"
    assert replayed(found).ok


def test_guard_rounds_are_replayed() -> None:
    ring = torus(32, 16, tube=0.3)
    reference = MeshFile("ring.obj", shapes.obj(ring.vertices, ring.faces))
    ball = sphere(3)

    found = Evidence.of(MeshFile("ball.obj", shapes.obj(ball.vertices, ball.faces)), reference, {})

    certificate = found.report.certificate
    assert certificate is not None
    assert certificate.holds
    assert certificate.cones["orientation"] > 0
    assert replayed(found).ok


def test_a_file_under_another_name_is_replayed(honest: Evidence) -> None:
    renamed = replace(honest, source=replace(honest.source, name="elsewhere.obj"))

    assert replayed(renamed).ok


def test_a_refinement_to_a_tolerance_is_replayed() -> None:
    found = meshcone.refine(rough(), smooth(), effort="fast", within="1e-9%")

    verification = meshcone.verify(found, replay=True)

    assert verification.ok, str(verification)


def test_a_tolerance_that_was_not_reached_cannot_be_stated_to_be() -> None:
    found = meshcone.refine(rough(), smooth(), effort="fast", within="1e-9%")
    assert found.report.within is not None
    within = found.report.within.model_copy(update={"reached": True, "places": ()})
    done = replace(found.done, report=found.report.model_copy(update={"within": within}))

    verification = meshcone.verify(replace(found, done=done), replay=True)

    assert "the report states another 'within" in str(verification)


def test_a_start_that_no_round_led_to_fails(honest: Evidence) -> None:
    chosen = Forgery(FAST, before=lambda pair: 1.05 * pair.source.vertices).of(honest)

    assert chosen.failed() == set()
    assert "refining again gives another file: a vertex is" in road(chosen).words
    assert not road(chosen).ok


def test_a_start_that_leads_to_the_same_file_fails(honest: Evidence) -> None:
    before = honest.certificate.before.copy()
    before[5] += 1e-9
    moved = honest.with_certificate(before=before)

    assert moved.failed() == set()
    assert road(moved).words == "refining again gives the same file with another certificate"


def test_a_metric_that_was_edited_fails(honest: Evidence) -> None:
    quality = honest.report.quality
    assert quality.refined is not None
    refined = quality.refined.model_copy(update={"emd": 0.0})
    edited = honest.with_report(quality=quality.model_copy(update={"refined": refined}))

    assert edited.failed() == set()
    assert "the report states another 'quality.refined.emd'" in road(edited).words


def test_an_option_out_of_range_is_no_fault_of_what_was_replayed() -> None:
    evidence = Evidence.of(rough(), smooth(), {**FAST, "surface": {"proximity": 2.0}})

    assert evidence.failed() == {"settings"}
    assert replayed(evidence).ok
    assert "SURFACE.PROXIMITY=2.0" in str(replayed(evidence))


def test_another_version_is_not_replayed(honest: Evidence) -> None:
    older = honest.with_report(version="0.0.1").with_document(version="0.0.1")

    assert "made by version 0.0.1, which alone can replay it" in road(older).words


def test_options_that_contradict_each_other_end_the_replay(honest: Evidence) -> None:
    cones = {"edge_cap": {"length": {"relative": 1e-3}}, "pin": {"vertices": [0, 1, 2, 3]}}
    options = parse_options({**FAST, "cones": cones})

    assert "refining again ends with" in road(honest.with_options(options)).words


def test_a_result_is_replayed_from_python() -> None:
    result = meshcone.refine(("rough.obj", rough().data), ("smooth.obj", smooth().data), **FAST)

    assert meshcone.verify(result, replay=True)
    assert "every round was solved again" in str(meshcone.verify(result, replay=True))
    assert "not replayed" in str(meshcone.verify(result))
