"""Pairs whose reference is points."""

from __future__ import annotations

import json

import numpy as np
import pytest

from meshcone.assets import read_asset
from meshcone.errors import InputError
from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.report.report import Report
from meshcone.verbs.audit import audit
from meshcone.verbs.measure import measure
from meshcone.verbs.refine import Refinement, refine
from meshcone.verbs.verify import verify
from meshcone.verbs.within import refine_within
from tests import shapes
from tests.points import on_sphere, ply_points, xyz

RADIUS = 20.0
VERTICES, FACES = shapes.sphere(3, RADIUS)
POINTS = on_sphere(8000, RADIUS)
CLOUD = MeshFile("scan.xyz", xyz(POINTS))
QUICK = {"quality": {"samples": 800, "emd_samples": 40}}


def ball(vertices: np.ndarray = VERTICES) -> MeshFile:
    return MeshFile("ball.obj", shapes.obj(vertices, FACES))


@pytest.fixture(scope="module")
def refinement() -> Refinement:
    return refine(ball(shapes.noisy(VERTICES, 0.3)), CLOUD, parse_options(QUICK))


def test_how_far_the_points_lie_from_the_mesh_is_proven_and_the_other_way_is_not_stated() -> None:
    from scipy.spatial import KDTree

    report = measure(ball(), CLOUD, parse_options(QUICK))

    # Points on a sphere are farthest from a flat face of it where its middle is.
    a, b, c = np.moveaxis(VERTICES[FACES], 1, 0)
    normals = np.cross(b - a, c - a)
    depth = RADIUS - np.abs((a * normals).sum(axis=1)) / np.linalg.norm(normals, axis=1)
    found = report.deviation
    assert found is not None
    assert (found.extra, found.max) == (None, None)
    assert 0.95 * depth.max() <= found.missing.lower_model <= found.missing.upper_model
    assert found.missing.upper_model <= depth.max() * 1.001
    assert report.statement is not None
    assert report.statement.startswith("every point of the reference within")
    extra = report.quality.directions.extra
    nearest = KDTree(POINTS).query(VERTICES)[0] / RADIUS
    assert extra.max >= nearest.max() - 1e-5
    assert report.quality.input.curvature_error is None
    assert report.asset is not None
    assert report.asset.reference is None


@pytest.mark.parametrize(
    ("gate", "bound", "verdict"),
    [
        ("deviation.missing", 1.0, "pass"),
        ("deviation.missing", 0.001, "fail"),
        ("deviation.max", 1.0, "not_tested"),
        ("curvature_error", 1.0, "not_tested"),
    ],
)
def test_gates_are_tested_where_something_is_known(gate: str, bound: float, verdict: str) -> None:
    kind = "max_model" if gate.startswith("deviation") else "max"
    options = {**QUICK, "gates": {gate: {kind: bound}}}

    report = measure(ball(), CLOUD, parse_options(options))

    assert report.gates is not None
    assert report.gates.verdict == verdict


def test_a_mesh_is_refined_towards_points(refinement: Refinement) -> None:
    after = read_asset("ball.obj", refinement.data).vertices

    errors = np.abs(np.linalg.norm(after, axis=1) - RADIUS)
    assert refinement.report.outcome == "improved"
    assert errors.std() < 0.05
    assert refinement.report.quality.directions.missing.mean < 0.1 / RADIUS


def test_a_refinement_towards_points_is_verified(refinement: Refinement) -> None:
    source, refined = ball(shapes.noisy(VERTICES, 0.3)), MeshFile("ball.obj", refinement.data)
    assert refinement.certificate is not None
    certificate = MeshFile("certificate", refinement.certificate)

    found = verify(refinement.report, certificate, source, CLOUD, refined)

    assert found.ok, str(found)


def test_a_report_that_states_the_other_way_is_a_forgery(refinement: Refinement) -> None:
    forged = json.loads(refinement.report.model_dump_json())
    forged["deviation"]["extra"] = forged["deviation"]["max"] = forged["deviation"]["missing"]
    source, refined = ball(shapes.noisy(VERTICES, 0.3)), MeshFile("ball.obj", refinement.data)
    assert refinement.certificate is not None
    certificate = MeshFile("certificate", refinement.certificate)

    report = Report.model_validate(forged)
    found = verify(report, certificate, source, CLOUD, refined)

    [check] = [each for each in found.checks if each.name == "deviation"]
    assert not check.ok
    assert "beyond points, which is unknown" in check.words


def test_what_lies_over_a_hole_between_the_points_is_not_drawn_to_its_rim() -> None:
    cloud = MeshFile("scan.ply", ply_points(POINTS[POINTS[:, 2] < 0.8 * RADIUS]))

    made = refine(ball(shapes.noisy(VERTICES, 0.2)), cloud, parse_options(QUICK))

    after = read_asset("ball.obj", made.data).vertices
    over = VERTICES[:, 2] > 0.85 * RADIUS
    assert np.abs(np.linalg.norm(after[over], axis=1) - RADIUS).max() < 0.1 * RADIUS
    assert after[over, 2].max() > 0.93 * RADIUS


def test_points_are_no_source_and_no_tolerance_is_proven_of_them() -> None:
    with pytest.raises(InputError, match=r"scan\.xyz.*it can be a reference alone"):
        measure(CLOUD, ball(), parse_options(QUICK))
    with pytest.raises(InputError, match=r"scan\.xyz.*it can be a reference alone"):
        audit(CLOUD, None, parse_options({"mode": "audit"}))
    options = {**QUICK, "effort": "fast", "within": "0.5"}
    with pytest.raises(InputError, match="the reference is points"):
        refine_within(ball(), CLOUD, parse_options(options))
