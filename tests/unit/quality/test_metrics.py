"""Metrics against values known by geometry."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.quality.metrics import (
    ClosestTriangles,
    aspect_ratio,
    compare,
    curvature_error,
    earth_movers_distance,
)
from meshcone.quality.validity import inspect
from meshcone.surface import Mesh
from meshcone.surface.closest import barycentric_weights
from tests.meshes import noisy, sphere, torus
from tests.unit.quality.measuring import metrics, sampled


def test_a_mesh_lies_on_itself() -> None:
    found = metrics(torus(), torus())

    assert found.point_to_surface.max < 1e-9
    assert found.surface_normal_consistency == pytest.approx(1)
    assert found.curvature_error < 1e-9


def test_a_mesh_is_compared_with_itself_as_if_its_points_were_searched_for() -> None:
    mesh = noisy(torus(), 0.02)
    turned = Mesh(mesh.vertices, mesh.faces[:, [1, 2, 0]])  # the same surface, which is no copy

    own, other = (sampled(mesh).closest_on(sampled(each, 1)) for each in (mesh, turned))
    here, there = (metrics(mesh, each) for each in (mesh, turned))

    np.testing.assert_allclose(own.distances, other.distances, atol=1e-12)
    np.testing.assert_allclose(own.points, other.points, atol=1e-12)
    shares = barycentric_weights(own.points, mesh, own.faces)
    carried = np.einsum("ij,ijk->ik", shares, mesh.corners[own.faces])
    np.testing.assert_allclose(carried, own.points, atol=1e-12)
    assert here.curvature_error == pytest.approx(there.curvature_error, abs=1e-9)
    assert here.surface_normal_consistency == pytest.approx(there.surface_normal_consistency)


def test_what_a_surface_has_let_go_of_is_made_again() -> None:
    surface, reference = sampled(noisy(sphere(2), 0.02)), sampled(sphere(3), seed=1)
    validity = inspect(surface.mesh, 1_000_000)
    first = compare(surface, reference, validity)

    surface.let_go()
    reference.let_go()

    assert compare(surface, reference, validity) == first


def test_concentric_spheres_are_as_far_apart_as_their_radii() -> None:
    inner, outer = sphere(4), sphere(4).moved_to(sphere(4).vertices * 1.1)

    found = metrics(inner, outer)

    assert found.point_to_surface.mean == pytest.approx(0.1, rel=0.01)
    assert found.point_to_surface.max == pytest.approx(0.1, rel=0.02)
    assert found.hausdorff >= found.point_to_surface.p95
    assert found.fscore == 0


def test_the_worst_point_is_the_tip_of_a_spike_that_no_sample_hits() -> None:
    vertices = sphere(4).vertices.copy()
    vertices[7] *= 1.5

    found = ClosestTriangles.between(
        sampled(sphere(4).moved_to(vertices)), sampled(sphere(4), 1)
    ).point_to_surface()

    assert found.max == pytest.approx(0.5, rel=1e-3)
    assert found.max_at == pytest.approx(tuple(vertices[7]))


def test_vertices_no_face_uses_do_not_count() -> None:
    ball = sphere(2)
    loose = Mesh(np.concatenate([ball.vertices, [[9.0, 9.0, 9.0]]]), ball.faces)

    assert metrics(loose, ball).point_to_surface.max < 1e-9


def test_normals_of_a_turned_plane_deviate_by_the_angle_it_was_turned() -> None:
    square = Mesh(
        np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0.0]]),
        np.array([[0, 1, 2], [0, 2, 3]]),
    )
    turn = np.radians(10)
    turned = square.moved_to(
        square.vertices @ [[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, 1]]
    )

    found = metrics(turned, square)

    assert found.normal_deviation_deg == pytest.approx(10, abs=0.1)
    assert found.surface_normal_consistency == pytest.approx(np.cos(turn), abs=1e-6)


def test_spheres_of_two_radii_differ_by_their_curvatures() -> None:
    small, large = sphere(5).moved_to(sphere(5).vertices * 0.8), sphere(5)

    error = curvature_error(sampled(small), sampled(large, 1))

    assert error == pytest.approx(1 / 0.8 - 1, rel=0.02)


def test_curvature_does_not_depend_on_which_side_is_called_outside() -> None:
    inside_out = Mesh(sphere(4).vertices, sphere(4).faces[:, ::-1])

    assert curvature_error(sampled(inside_out), sampled(sphere(4), 1)) < 1e-9


def test_emd_of_a_translated_cloud_is_the_translation() -> None:
    points = np.random.default_rng(0).normal(size=(64, 3))

    assert earth_movers_distance(points, points + np.array([0.3, 0, 0])) == pytest.approx(0.3)


def test_an_equilateral_triangle_has_aspect_ratio_one() -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0.5, np.sqrt(3) / 2, 0]])

    found = aspect_ratio(Mesh(corners, np.array([[0, 1, 2]])))

    assert found.mean == pytest.approx(1)
    assert found.share_over_4 == 0


def test_a_face_without_area_counts_as_a_sliver_and_spoils_no_mean() -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0.5, np.sqrt(3) / 2, 0], [2, 0, 0]])

    found = aspect_ratio(Mesh(corners, np.array([[0, 1, 2], [0, 1, 3]])))

    assert found.mean == pytest.approx(1)
    assert found.share_over_4 == 0.5


def test_a_mesh_of_faces_without_area_has_slivers_and_no_shape() -> None:
    line = Mesh(np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0.0]]), np.array([[0, 1, 2]]))

    found = aspect_ratio(line)

    assert (found.mean, found.median, found.share_over_4) == (0, 0, 1)
