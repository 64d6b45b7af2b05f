from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from meshcone.assets.polygons import triangulate


def area_vectors(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    a, b, c = (points[triangles[:, corner]] for corner in range(3))
    return np.cross(b - a, c - a) / 2


def test_a_convex_polygon_is_a_fan_from_its_first_corner():
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    triangles, _ = triangulate(square, np.array([4]))
    assert triangles.tolist() == [[0, 1, 2], [0, 2, 3]]


@pytest.mark.parametrize("turn", range(4))
def test_a_concave_quad_is_split_at_its_reflex_corner(turn):
    arrow = np.roll([[0.0, 0, 0], [2, -1, 0], [0.5, 0, 0], [2, 1, 0]], turn, axis=0)
    triangles, _ = triangulate(arrow, np.array([4]))
    areas = area_vectors(arrow, triangles)[:, 2]
    assert (areas < 0).all() or (areas > 0).all()


def test_polygons_of_several_sizes_keep_their_order():
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    points = np.concatenate([corners[:3], corners, corners[:3]])
    triangles, _ = triangulate(points, np.array([3, 4, 3]))
    assert triangles.tolist() == [[0, 1, 2], [3, 4, 5], [3, 5, 6], [7, 8, 9]]


@given(
    radii=st.lists(st.floats(0.1, 1), min_size=5, max_size=24),
    tilt=st.tuples(*[st.floats(-3, 3)] * 3),
)
def test_ears_cover_a_star_shaped_polygon_exactly_once(radii, tilt):
    angles = np.linspace(0, 2 * np.pi, len(radii), endpoint=False)
    flat = np.column_stack([np.cos(angles) * radii, np.sin(angles) * radii])
    a, b, c = tilt
    basis = np.linalg.qr(np.array([[1, a, b], [0, 1, c], [0, 0, 1]]))[0]
    points = flat @ basis[:2]
    triangles, fanned = triangulate(points, np.array([len(radii)]))
    areas = area_vectors(points, triangles) @ np.cross(basis[0], basis[1])
    x, y = flat.T
    expected = (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() / 2
    assert fanned == 0
    assert areas.min() > -1e-9
    assert areas.sum() == pytest.approx(expected)


def test_a_polygon_that_crosses_itself_still_gives_its_number_of_triangles():
    bow = np.array([[0.0, 0, 0], [1, 1, 0], [1, 0, 0], [0, 1, 0], [-1, 0.5, 0]])
    triangles, _ = triangulate(bow, np.array([5]))
    assert triangles.shape == (3, 3)
