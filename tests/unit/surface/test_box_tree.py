"""Closest points by the tree of boxes, against libigl and against every face by itself."""

from __future__ import annotations

import igl
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meshcone.surface import Mesh, SurfaceTree
from meshcone.surface.compiled import compiled
from tests.meshes import noisy, sheet, sphere, torus


def soup(seed: int, faces: int = 40) -> Mesh:
    """Triangles at random, some without area, some twice, on a coarse grid half of the time."""
    rng = np.random.default_rng(seed)
    vertices = rng.normal(size=(faces, 3))
    if seed % 2:
        vertices = np.round(vertices)
    drawn = rng.integers(0, faces, size=(faces, 3))
    return Mesh(vertices, np.concatenate([drawn, drawn[:3, ::-1]]))


def around(mesh: Mesh, seed: int, count: int = 60) -> np.ndarray:
    """Points near a mesh, far from it, and on its corners and faces."""
    rng = np.random.default_rng(seed)
    scattered = rng.normal(size=(count, 3)) * rng.choice([0.01, 1, 100], size=(count, 1))
    return np.concatenate([scattered, mesh.vertices, mesh.corners.mean(axis=1)])


@given(st.integers(0, 10_000))
@settings(max_examples=30, deadline=None)
def test_distances_are_those_of_libigl(seed: int):
    mesh = soup(seed)
    points = around(mesh, seed)

    found = SurfaceTree(mesh).closest(points)

    squared, _, _ = igl.point_mesh_squared_distance(points, mesh.vertices, mesh.faces)
    np.testing.assert_allclose(found.distances, np.sqrt(squared), rtol=1e-9, atol=1e-9)


@given(st.integers(0, 10_000))
@settings(max_examples=30, deadline=None)
def test_a_face_found_is_the_first_of_the_closest(seed: int):
    mesh = soup(seed)
    points = around(mesh, seed)

    squared, faces, _ = mesh.tree.search(points)

    alone = np.stack(
        [Mesh(mesh.vertices, face[None]).tree.search(points)[0] for face in mesh.faces]
    )
    np.testing.assert_array_equal(faces, alone.argmin(axis=0))
    np.testing.assert_array_equal(squared, alone.min(axis=0))


def test_of_the_faces_around_a_corner_the_first_is_found():
    mesh = sphere(2)

    found = SurfaceTree(mesh).closest(1.5 * mesh.vertices)

    first = [np.flatnonzero((mesh.faces == v).any(axis=1))[0] for v in range(len(mesh.vertices))]
    np.testing.assert_array_equal(found.faces, first)
    np.testing.assert_array_equal(found.points, mesh.vertices)


@given(st.integers(0, 10_000))
@settings(max_examples=30, deadline=None)
def test_of_the_two_faces_at_a_ridge_the_first_is_found(seed: int):
    rng = np.random.default_rng(seed)
    corners = rng.normal(size=(4, 3)) * [1, 1, 0.1] - [[0, 0, 0], [0, 0, 0], [0, 0, 5], [0, 0, 5]]
    ridge = Mesh(corners, np.array([[0, 1, 2], [1, 0, 3]]))
    turned = Mesh(ridge.vertices, ridge.faces[::-1, [1, 2, 0]])
    shares = rng.random((20, 1))
    above = shares * corners[0] + (1 - shares) * corners[1] + [0, 0, 3]

    found, again = (SurfaceTree(mesh).closest(above) for mesh in (ridge, turned))

    np.testing.assert_array_equal([found.faces, again.faces], 0)
    np.testing.assert_array_equal(found.points, again.points)


def test_a_needle_is_as_far_as_its_points_are():
    # Exact in binary: a triangle of length 1 and height 2⁻ᵏ, and a place within it.
    for power in range(4, 60):
        height = 2.0**-power
        needle = Mesh(np.array([[0, 0, 0], [1, 0, 0], [0.5, height, 0]]), np.array([[0, 1, 2]]))
        inside = np.array([[0.375, height / 4, 0.0], [0.375, height / 4, 0.5]])

        found = SurfaceTree(needle).closest(inside)

        np.testing.assert_allclose(found.distances, [0, 0.5], rtol=0, atol=1e-8)


def test_what_a_tree_was_built_from_leaves_no_trace():
    mesh = torus()
    moved = mesh.vertices[:, [2, 0, 1]] * [3.0, 1.0, 0.2]
    assert mesh.tree.faces is mesh.faces
    points = around(mesh, seed=1)

    refitted, built = mesh.moved_to(moved), Mesh(moved, mesh.faces)

    assert refitted.tree.order is mesh.tree.order
    for name in ("distances", "faces", "points"):
        here, there = (
            getattr(SurfaceTree(each).closest(points), name) for each in (refitted, built)
        )
        np.testing.assert_array_equal(here, there)


def test_the_order_of_points_leaves_no_trace():
    mesh = noisy(torus(), 0.02)
    points = around(mesh, seed=2)
    shuffled = np.random.default_rng(0).permutation(len(points))

    found, again = (SurfaceTree(mesh).closest(each) for each in (points, points[shuffled]))

    np.testing.assert_array_equal(found.faces[shuffled], again.faces)
    np.testing.assert_array_equal(found.points[shuffled], again.points)


def test_a_point_that_is_not_finite_is_infinitely_far_and_disturbs_no_other():
    tree = SurfaceTree(sheet(3, 3))

    found = tree.closest(np.array([[0.5, 0.5, 2], [np.nan, 0, 0], [np.inf, 0, 0], [0.5, 0.5, -1]]))

    np.testing.assert_array_equal(found.distances, [2, np.inf, np.inf, 1])
    np.testing.assert_array_equal(found.faces[1:3], 0)


def test_points_of_any_layout_are_taken():
    tree = SurfaceTree(sheet(3, 3))
    points = np.array([[0.5, 0.5, 2.0], [1.5, 0.5, 1.0]])
    fixed = points.copy()
    fixed.flags.writeable = False

    for given_ in (np.asfortranarray(points), fixed, points.astype(np.float32), points[::-1][::-1]):
        np.testing.assert_array_equal(tree.closest(given_).distances, [2, 1])


def test_no_points_and_no_faces_are_no_trouble():
    nothing = Mesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))

    assert SurfaceTree(sheet(2, 2)).closest(np.zeros((0, 3))).points.shape == (0, 3)
    assert SurfaceTree(nothing).closest(np.zeros((1, 3))).distances == np.inf


@pytest.mark.parametrize("signature", [None, "float64(float64[::1])"])
def test_a_function_without_a_place_to_be_kept_is_compiled_all_the_same(signature: str | None):
    source = "def total(values):\n    return values.sum()\n"
    names: dict = {}
    exec(compile(source, "<nowhere>", "exec"), names)  # noqa: S102 - it has no file of its own

    assert compiled(signature)(names["total"])(np.arange(4.0)) == 6
