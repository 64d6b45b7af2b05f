"""What must not change a metric: where a mesh lies, how large it is, how a file lists it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from meshcone.quality.records import Metrics
from meshcone.surface import Mesh
from tests.meshes import noisy, sphere, torus
from tests.unit.quality.measuring import framed_metrics

# Without symmetries: a shape that has no principal axes takes them from the file's order.
ROUND = torus(24, 12)
REFERENCE = noisy(ROUND.moved_to(ROUND.vertices * [1.0, 0.8, 0.6]), 0.01, seed=1)
SOURCE = noisy(REFERENCE, 0.03, seed=2)
STILL = framed_metrics(SOURCE, REFERENCE)

seeds = st.integers(0, 2**31)


def numbers(metrics: Metrics) -> dict[str, Any]:
    """Every number but where the worst point is, which moves with the mesh."""
    document = metrics.model_dump()
    flat = document | {
        f"{name}.{key}": value
        for name in ("point_to_surface", "aspect_ratio", "validity")
        for key, value in document.pop(name).items()
    }
    del flat["point_to_surface.max_at"], flat["validity.flipped_faces"]
    return flat


def relisted(mesh: Mesh, seed: int) -> Mesh:
    """The same triangles, with vertices, faces and corners listed in another order."""
    rng = np.random.default_rng(seed)
    new_place = rng.permutation(len(mesh.vertices))
    vertices = np.empty_like(mesh.vertices)
    vertices[new_place] = mesh.vertices
    first = rng.integers(3, size=(len(mesh.faces), 1))
    faces = np.take_along_axis(mesh.faces, (first + np.arange(3)) % 3, axis=1)
    return Mesh(vertices, new_place[faces][rng.permutation(len(faces))])


def assert_same(found: Metrics) -> None:
    assert numbers(found) == pytest.approx(numbers(STILL), rel=1e-6, abs=1e-9)


def in_radii(mesh: Mesh, seed: int, scale: float) -> tuple[Mesh, Any]:
    rng = np.random.default_rng(seed)
    rotation, offset = Rotation.random(rng=rng).as_matrix(), rng.normal(size=3)
    return mesh.moved_to(scale * mesh.vertices @ rotation.T + offset), rotation


@settings(max_examples=15, deadline=None)
@given(seeds, seeds)
def test_the_order_of_vertices_faces_and_corners_changes_no_metric(first: int, second: int) -> None:
    assert_same(framed_metrics(relisted(SOURCE, first), relisted(REFERENCE, second)))


@settings(max_examples=15, deadline=None)
@given(st.floats(1e-3, 1e3), st.tuples(*[st.floats(-10, 10)] * 3))
def test_scale_and_place_change_no_metric(scale: float, offset: tuple[float, float, float]) -> None:
    def moved(mesh: Mesh) -> Mesh:
        return mesh.moved_to(scale * (mesh.vertices + offset))

    assert_same(framed_metrics(moved(SOURCE), moved(REFERENCE)))


@settings(max_examples=15, deadline=None)
@given(seeds, st.floats(0.1, 10))
def test_a_rotation_changes_metrics_by_no_more_than_the_radius_they_are_relative_to(
    seed: int, scale: float
) -> None:
    source, _ = in_radii(SOURCE, seed, scale)
    reference, _ = in_radii(REFERENCE, seed, scale)

    found = framed_metrics(source, reference)

    # The box that gives the frame its centre turns with the axes, not with the mesh: it is
    # the one thing that does not move rigidly.
    assert found.aspect_ratio.model_dump() == pytest.approx(STILL.aspect_ratio.model_dump())
    assert found.validity == STILL.validity
    assert found.normal_consistency == pytest.approx(STILL.normal_consistency)
    assert found.surface_normal_consistency == pytest.approx(STILL.surface_normal_consistency)
    assert found.normal_deviation_deg == pytest.approx(STILL.normal_deviation_deg)
    relative = found.point_to_surface.mean / STILL.point_to_surface.mean
    assert found.emd == pytest.approx(relative * STILL.emd)
    assert found.hausdorff == pytest.approx(relative * STILL.hausdorff)
    assert found.chamfer == pytest.approx(relative**2 * STILL.chamfer)
    assert relative == pytest.approx(1, abs=0.2)


def test_a_symmetric_mesh_listed_otherwise_stays_within_the_floor() -> None:
    ball, other = sphere(3), relisted(sphere(3), 5)

    found, floor = framed_metrics(other, ball), framed_metrics(ball, ball)

    assert found.point_to_surface.max < 1e-9
    assert found.emd == pytest.approx(floor.emd, rel=0.2)
    assert found.chamfer_l1 == pytest.approx(floor.chamfer_l1, rel=0.05)
