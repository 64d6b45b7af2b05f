"""Faces that are stored twice are taken once."""

from __future__ import annotations

import numpy as np

from meshcone.surface import Mesh, without_copies
from tests.meshes import sphere


def two_sided(mesh: Mesh, seed: int) -> Mesh:
    """Store every face for either side, in an order of chance, the front of each first."""
    order = np.random.default_rng(seed).permutation(len(mesh.faces))
    turned = np.roll(mesh.faces[:, ::-1], 1, axis=1)
    return Mesh(mesh.vertices, np.stack([mesh.faces, turned], axis=1)[order].reshape(-1, 3))


def test_of_a_face_for_either_side_the_first_is_kept() -> None:
    ball = sphere(1)
    doubled = two_sided(ball, seed=3)

    single, kept = without_copies(doubled)

    np.testing.assert_array_equal(kept, np.arange(0, len(doubled.faces), 2))
    np.testing.assert_array_equal(single.faces, doubled.faces[::2])
    assert {tuple(face) for face in single.faces} == {tuple(face) for face in ball.faces}


def test_a_mesh_without_copies_is_returned_itself() -> None:
    ball = sphere(1)

    assert without_copies(ball) == (ball, None)


def test_faces_over_the_same_places_that_share_no_vertices_are_no_copies() -> None:
    ball = sphere(1)
    twice = Mesh(
        np.concatenate([ball.vertices, ball.vertices]),
        np.concatenate([ball.faces, ball.faces + len(ball.vertices)]),
    )

    assert without_copies(twice)[1] is None


def test_points_of_one_place_are_no_copies() -> None:
    points = Mesh(np.zeros((3, 3)), np.array([[0, 1, 2], [0, 1, 2]]), is_points=True)

    assert without_copies(points)[1] is None
