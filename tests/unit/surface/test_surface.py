"""Meshes, frames, samples and closest points, against values known otherwise."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from meshcone.errors import InputError
from meshcone.surface import Frame, Mesh, SurfaceTree, sample_surface
from meshcone.surface.closest import barycentric_weights
from tests.meshes import noisy, sheet, sphere, torus


def test_edges_of_a_closed_mesh_satisfy_euler():
    mesh = torus()

    assert len(mesh.vertices) - len(mesh.edges) + len(mesh.faces) == 0


def test_edges_are_unique_and_ordered():
    edges = sphere(2).edges

    assert np.all(edges[:, 0] < edges[:, 1])
    assert len(np.unique(edges, axis=0)) == len(edges)


def test_normals_point_outwards_from_a_sphere():
    mesh = sphere(3)

    assert np.all(np.einsum("ij,ij->i", mesh.vertex_normals, mesh.vertices) > 0.99)


def test_area_is_trimeshs():
    mesh = noisy(torus(), 0.05)

    assert mesh.face_areas.sum() == pytest.approx(trimesh.Trimesh(mesh.vertices, mesh.faces).area)


def test_the_frame_puts_the_reference_into_the_unit_sphere_and_back():
    mesh = torus().moved_to(torus().vertices * 40 + [5, -3, 100])
    frame = Frame.of(mesh)

    inside = frame.into(mesh.vertices)

    assert np.linalg.norm(inside, axis=1).max() == pytest.approx(1)
    np.testing.assert_allclose(frame.out_of(inside), mesh.vertices)


def test_a_reference_of_one_point_has_no_frame():
    with pytest.raises(InputError, match="no extent"):
        Frame.of(Mesh(np.ones((3, 3)), np.array([[0, 1, 2]])))


@pytest.mark.parametrize("method", ["sobol", "random"])
def test_samples_are_uniform_by_area(method: str):
    mesh = sheet(11, 11)
    lopsided = mesh.moved_to(mesh.vertices**2 / 10)

    samples = sample_surface(lopsided, 4096, seed=0, method=method)

    np.testing.assert_allclose(samples.points[:, :2].mean(axis=0), [5, 5], atol=0.2)


def test_sobol_samples_vary_less_than_random_ones():
    mesh = torus()

    def spread(method: str) -> float:
        means = [sample_surface(mesh, 512, seed, method).points[:, 0].mean() for seed in range(20)]
        return float(np.std(means))

    assert spread("sobol") < 0.5 * spread("random")


def test_samples_in_space_are_the_same_and_each_is_near_the_one_before():
    drawn = sample_surface(torus(), 2000, seed=3)

    ordered = drawn.in_space()

    before, after = (
        {(*point, *normal, face) for point, normal, face in zip(*columns, strict=True)}
        for columns in ((s.points, s.normals, s.faces) for s in (drawn, ordered))
    )
    steps, leaps = (np.linalg.norm(np.diff(s.points, axis=0), axis=1) for s in (ordered, drawn))
    assert before == after
    assert steps.mean() < 0.2 * leaps.mean()


def test_the_same_seed_gives_the_same_samples():
    first, second = (sample_surface(torus(), 100, seed=3).points for _ in range(2))

    np.testing.assert_array_equal(first, second)


def test_closest_points_are_trimeshs():
    mesh = torus()
    queries = np.random.default_rng(0).normal(size=(200, 3))

    found = SurfaceTree(mesh).closest(queries)

    _, distances, _ = trimesh.proximity.closest_point_naive(
        trimesh.Trimesh(mesh.vertices, mesh.faces), queries
    )
    np.testing.assert_allclose(found.distances, distances, atol=1e-12)


@given(st.tuples(st.floats(0, 1), st.floats(0, 1)))
def test_barycentric_weights_reproduce_the_point(where: tuple[float, float]):
    mesh = torus(8, 6)
    u, v = sorted(where)
    expected = np.array([u, v - u, 1 - v])
    point = expected @ mesh.corners[7]

    weights = barycentric_weights(point[None], mesh, np.array([7]))

    np.testing.assert_allclose(weights[0] @ mesh.corners[7], point, atol=1e-12)


def test_a_face_without_area_has_even_weights():
    flat = Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]), np.array([[0, 1, 2]]))

    weights = barycentric_weights(np.array([[0.5, 0, 0]]), flat, np.array([0]))

    np.testing.assert_allclose(weights, 1 / 3)


def test_a_mesh_that_nobody_can_write_to_is_sampled_like_any_other():
    mesh = torus(8, 6)
    locked = Mesh(mesh.vertices.copy(), mesh.faces.copy())
    for array in (locked.vertices, locked.faces):
        array.flags.writeable = False

    samples = sample_surface(locked, 10, seed=0)
    weights = barycentric_weights(samples.points, locked, samples.faces)

    np.testing.assert_array_equal(samples.points, sample_surface(mesh, 10, seed=0).points)
    np.testing.assert_allclose(weights.sum(axis=1), 1)
