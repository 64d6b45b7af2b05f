"""A mesh is as far from another as its farthest place, be that within a face."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.quality.farthest import beyond, largest_distance
from meshcone.surface import Mesh, SurfaceTree
from tests.meshes import noisy, sheet, sphere, together

BALL = sphere(4)
OCTAHEDRON = Mesh(
    np.concatenate([np.eye(3), -np.eye(3)]),
    np.array([[x, y, z] for x in (0, 3) for y in (1, 4) for z in (2, 5)]),
)


def test_a_face_is_farther_away_than_its_corners() -> None:
    found = largest_distance(OCTAHEDRON, SurfaceTree(BALL), 0.0)

    assert found == pytest.approx(1 - 1 / np.sqrt(3), rel=0.02)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_the_largest_distance_is_that_of_many_samples(seed: int) -> None:
    coarse, tree = noisy(OCTAHEDRON, 0.2, seed), SurfaceTree(noisy(BALL, 0.02, seed))
    shares = np.random.default_rng(seed).dirichlet([0.7] * 3, 5000)
    places = np.einsum("kj,mjd->mkd", shares, coarse.corners).reshape(-1, 3)

    found = largest_distance(coarse, tree, 0.0)

    assert found == pytest.approx(float(tree.closest(places).distances.max()), rel=0.02)


def test_what_is_nearer_than_the_least_does_not_matter() -> None:
    assert largest_distance(OCTAHEDRON, SurfaceTree(BALL), 0.7) == 0.7


def test_a_vertex_that_no_face_uses_is_nowhere() -> None:
    astray = Mesh(np.append(BALL.vertices, [[9.0, 9, 9]], axis=0), BALL.faces)

    assert largest_distance(astray, SurfaceTree(BALL), 0.0) < 1e-9


def test_the_corners_of_a_face_with_a_place_beyond_the_limit_are_named() -> None:
    # The second sheet's corners lie on the ridge of the first, and its middle 1 above the valley.
    flat = sheet(3, 3)
    sunken = flat.vertices.copy()
    sunken[4, 2] = -1
    across = Mesh(flat.vertices[[0, 2, 8]], np.array([[0, 1, 2]]))
    mesh = together(flat.moved_to(sunken), across)

    found = beyond(mesh, SurfaceTree(flat.moved_to(sunken)), 0.5)

    np.testing.assert_array_equal(found.vertices, [9, 10, 11])
    assert found.points[:, 2] == pytest.approx(0.0)
    assert np.abs(found.points[:, :2] - 1).max() < 0.5
