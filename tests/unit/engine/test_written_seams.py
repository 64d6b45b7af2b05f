"""What is proven of a refined file holds for every copy that it stores of a vertex."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.assets import read_asset
from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.quality.records import Metrics
from meshcone.report.report import Report
from meshcone.surface.arrays import Floats
from meshcone.verbs.measure import measure
from tests import shapes
from tests.unit.assets.builders import Gltf
from tests.unit.engine.evidence import Evidence

RADIUS = 2.0
FAR = -65536.0  # a float32 at this distance is a multiple of 2⁻⁷
NARROW = {"effort": "fast", "deviation": {"width": 1e-7, "share": 1e-6}}


def with_a_face_far_from_its_node() -> MeshFile:
    """A ball of two nodes; the vertices of one face are stored in coarse steps in one of them.

    All copies of a vertex are at one place to the last bit, so that they are welded.
    """
    vertices, faces = shapes.sphere(2, RADIUS)
    vertices = np.round(shapes.noisy(vertices, 0.001, seed=7) * 1024) / 1024
    vertices[faces[0]] = np.round(vertices[faces[0]] * 128) / 128
    gltf = Gltf()
    for chosen, place in ((faces[:1], FAR), (faces[1:], 0.0)):
        used, local = np.unique(chosen, return_inverse=True)
        positions = (vertices[used] - place).astype(np.float32)
        primitive = {
            "attributes": {"POSITION": gltf.accessor(positions)},
            "indices": gltf.accessor(local.reshape(-1).astype(np.uint32)),
        }
        gltf.node(mesh=gltf.mesh(primitive), translation=[place] * 3)
    return MeshFile("far.glb", gltf.glb())


def ball() -> MeshFile:
    return MeshFile("ball.obj", shapes.obj(*shapes.sphere(2, RADIUS)))


@pytest.fixture(scope="module")
def made() -> Evidence:
    return Evidence.of(with_a_face_far_from_its_node(), ball(), NARROW)


def farthest_copy(file: MeshFile, reference: MeshFile) -> float:
    """How far a vertex of a file is from another file's triangles: all with all, in long double."""
    asset, target = (read_asset(each.name, each.data) for each in (file, reference))
    points = asset.positions.astype(np.longdouble)
    corners = target.positions.astype(np.longdouble)[target.triangles]
    nearest = np.full(len(points), np.inf, dtype=np.longdouble)
    for triangle in corners:
        nearest = np.minimum(nearest, to_triangle(points, triangle))
    return float(nearest.max())


def to_triangle(points: Floats, triangle: Floats) -> Floats:
    a, b, c = triangle
    normal = np.cross(b - a, c - a)
    normal = normal / np.sqrt(normal @ normal)
    height = (points - a) @ normal
    feet = points - height[:, None] * normal
    inside = np.ones(len(points), dtype=bool)
    found = np.full(len(points), np.inf, dtype=points.dtype)
    for start, end in ((a, b), (b, c), (c, a)):
        side = end - start
        inside &= np.cross(side, feet - start) @ normal >= 0
        along = np.clip((points - start) @ side / (side @ side), 0, 1)
        away = points - start - along[:, None] * side
        found = np.minimum(found, np.sqrt((away**2).sum(axis=1)))
    return np.where(inside, np.abs(height), found)


def test_the_upper_end_bounds_every_copy_of_a_vertex(made: Evidence) -> None:
    truth = farthest_copy(made.refined, made.reference)
    stated = made.report.deviation
    assert stated is not None
    assert stated.extra is not None

    assert refined(made.report).point_to_surface.max * RADIUS < 0.8 * truth  # which is of one copy
    assert stated.extra.upper_model >= truth


def test_both_ends_hold_for_the_file_measured_by_itself(made: Evidence) -> None:
    stated = made.report.deviation
    measured = measure(made.refined, made.reference, parse_options(NARROW)).deviation
    assert stated is not None
    assert measured is not None

    for name in ("extra", "missing", "max"):
        told, found = getattr(stated, name), getattr(measured, name)
        assert told.lower_model <= found.upper_model
        assert told.upper_model >= found.lower_model


def test_displacement_and_precision_are_those_of_the_farthest_copy(made: Evidence) -> None:
    before, after = (
        read_asset(each.name, each.data).positions for each in (made.source, made.refined)
    )
    moved = np.linalg.norm(after - before, axis=1)
    certificate = made.report.certificate
    assert certificate is not None

    assert made.report.displacement.max == pytest.approx(moved.max() / RADIUS, rel=1e-6)
    # Half a step of the coarse copies, where no other copy is off by a thousandth of that.
    assert certificate.precision == pytest.approx(2**-8 / RADIUS, rel=0.9)
    assert made.failed() == set()


def test_a_report_that_leaves_the_seams_out_fails(made: Evidence) -> None:
    stated = made.report.deviation
    assert stated is not None
    assert stated.extra is not None
    seam = stated.extra.upper - refined(made.report).point_to_surface.max
    without = {
        name: getattr(stated, name).model_copy(
            update={
                "upper": getattr(stated, name).upper - seam,
                "upper_model": getattr(stated, name).upper_model - seam * RADIUS,
            }
        )
        for name in ("extra", "missing", "max")
    }

    assert "deviation" in made.with_report(deviation=stated.model_copy(update=without)).failed()


def refined(report: Report) -> Metrics:
    assert report.quality.refined is not None
    return report.quality.refined
