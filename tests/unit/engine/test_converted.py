"""Pairs whose reference is a file of a design program."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.verbs.measure import measure
from meshcone.verbs.refine import refine
from meshcone.verbs.verify import verify
from tests import shapes
from tests.cad import step_ball

RADIUS = 20.0
QUICK = {"effort": "fast", "quality": {"samples": 400, "emd_samples": 40}}
BALL = MeshFile("ball.step", step_ball(RADIUS))


@pytest.mark.parametrize("chord", [0.2, 0.02])
def test_the_proven_interval_is_of_the_true_surface(chord: float) -> None:
    vertices, faces = shapes.sphere(2, RADIUS)
    # Every corner is on the sphere, so that the planes' distances say how far the faces cut in.
    a, b, c = (vertices[faces[:, corner]] for corner in range(3))
    normals = np.cross(b - a, c - a)
    planes = np.abs(np.einsum("ij,ij->i", a, normals)) / np.linalg.norm(normals, axis=1)
    truth = RADIUS - planes.min()
    options = {**QUICK, "of_reference": {"chord": chord}}

    report = measure(
        MeshFile("scan.obj", shapes.obj(vertices, faces)), BALL, parse_options(options)
    )

    found = report.deviation
    assert found is not None
    assert report.inputs.reference.tolerance == chord
    assert found.extra.lower_model <= truth <= found.extra.upper_model
    assert found.extra.upper_model - found.extra.lower_model >= 2 * chord * 0.9
    assert report.statement is not None
    assert " mm of the reference" in report.statement


def test_a_gate_within_the_tolerance_of_its_bound_is_not_tested() -> None:
    vertices, faces = shapes.sphere(2, RADIUS)
    scan = MeshFile("scan.obj", shapes.obj(vertices, faces))
    whole = measure(scan, BALL, parse_options({**QUICK, "of_reference": {"chord": 0.02}}))
    assert whole.deviation is not None
    near = (whole.deviation.max.lower_model + whole.deviation.max.upper_model) / 2

    def verdict(bound: float, chord: float) -> str:
        gates = {"deviation.max": {"max_model": bound}}
        options = {**QUICK, "of_reference": {"chord": chord}, "gates": gates}
        report = measure(scan, BALL, parse_options(options))
        assert report.gates is not None
        return str(report.gates.verdict)

    assert verdict(near, 0.2) == "not_tested"
    assert verdict(near + 0.5, 0.2) == "pass"
    assert verdict(near - 0.3, 0.02) == "fail"


def test_a_scan_is_refined_towards_a_step_and_verified() -> None:
    vertices, faces = shapes.sphere(3, RADIUS)
    scan = MeshFile("scan.obj", shapes.obj(shapes.noisy(vertices, 0.3), faces))

    made = refine(scan, BALL, parse_options({**QUICK, "of_reference": {"chord": 0.2}}))

    assert made.report.outcome == "improved"
    assert made.certificate is not None
    certificate = MeshFile("certificate", made.certificate)
    found = verify(made.report, certificate, scan, BALL, MeshFile(made.name, made.data))
    assert found.ok, str(found)
