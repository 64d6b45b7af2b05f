from __future__ import annotations

import numpy as np
import pytest

from meshcone.assets.normals import realign_tangents, recompute_normals

ROOF = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0]])
ROOF_FACES = np.array([[0, 1, 2], [0, 2, 3]])
UP = np.array([0.0, 0, 1])


def renew(after, stored, corners=ROOF_FACES, weld=(0, 1, 2, 3)):
    weld = np.array(weld)
    return recompute_normals(ROOF, after, ROOF_FACES, np.array(corners), weld, np.array(stored))


def lifted(vertex, height=1.0):
    after = ROOF.copy()
    after[vertex, 2] += height
    return after


def test_a_smooth_vertex_gets_the_angle_weighted_mean_of_its_triangles():
    normals, _ = renew(lifted(1), [UP] * 4)
    right = np.array([-1, 0, 1]) / np.sqrt(2)
    expected = right + UP  # both triangles meet the ridge's foot at a right angle
    assert normals[0] == pytest.approx(expected / np.linalg.norm(expected))


def test_vertices_of_triangles_that_stayed_keep_their_normal():
    _, renewed = renew(lifted(1), [UP] * 4)
    assert renewed.tolist() == [True, True, True, False]


def test_different_normals_at_one_vertex_stay_a_hard_edge():
    stored = [UP, UP, UP, UP + 0.1, UP + 0.1, UP + 0.1]
    corners = [[0, 1, 2], [4, 5, 3]]
    normals, _ = renew(lifted(1), stored, corners, weld=(0, 1, 2, 3, 0, 2))
    assert normals[0] == pytest.approx(np.array([-1, 0, 1]) / np.sqrt(2))
    assert normals[4] == pytest.approx(stored[4])


def test_equal_normals_across_a_texture_seam_stay_smooth():
    corners = [[0, 1, 2], [4, 5, 3]]
    normals, _ = renew(lifted(1), [UP] * 6, corners, weld=(0, 1, 2, 3, 0, 2))
    assert normals[0] == pytest.approx(normals[4])


def test_a_normal_that_opposed_its_triangles_still_does():
    normals, _ = renew(lifted(1), [-UP] * 4)
    assert normals[1] == pytest.approx(np.array([1, 0, -1]) / np.sqrt(2))


def test_a_broken_normal_is_left_alone():
    _, renewed = renew(lifted(1), [UP, UP * np.nan, UP, UP])
    assert not renewed[1]


def test_a_tangent_turns_with_its_normal_and_keeps_its_hand():
    normals = np.array([[-1, 0, 1]]) / np.sqrt(2)
    tangents, due = realign_tangents(np.array([[1.0, 0, 0, -1]]), normals)
    assert due.all()
    assert tangents[0] == pytest.approx([np.sqrt(0.5), 0, np.sqrt(0.5), -1])


def test_a_tangent_along_its_normal_stays():
    tangents, due = realign_tangents(np.array([[0.0, 0, 2, 1]]), UP[None])
    assert tangents[0].tolist() == [0, 0, 2, 1]
    assert not due.any()


@pytest.mark.parametrize("broken", [[np.nan, 0, 0, 1], [np.inf, 0, 0, 1], [1, 0, 0, np.nan]])
def test_a_tangent_that_is_not_finite_stays(broken: list[float]) -> None:
    tangents, due = realign_tangents(np.array([broken, [1, 0, 0, 1]]), np.array([UP, UP]))
    assert tangents[0] == pytest.approx(broken, nan_ok=True)
    assert due.tolist() == [False, True]
