"""On thin bodies, a point is compared with the side that faces its way."""

from __future__ import annotations

import numpy as np

from meshcone.appearance.facing import REACH, FacingSurface
from meshcone.surface import Mesh, SurfaceTree


def plate(thickness: float) -> Mesh:
    """Two unit squares, one above the other, that face away from each other."""
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=float)
    top = np.column_stack([corners, np.full(4, thickness)])
    bottom = np.column_stack([corners, np.zeros(4)])
    faces = [[0, 1, 2], [0, 2, 3], [6, 5, 4], [7, 6, 4]]
    return Mesh(np.concatenate([top, bottom]), np.array(faces))


def search(mesh: Mesh, point: tuple[float, ...], normal: tuple[float, ...]) -> np.ndarray:
    points = np.array([point])
    found = SurfaceTree(mesh).closest(points)
    answer = FacingSurface(mesh).closest(points, np.array([normal]), found)
    assert answer.distances[0] == np.linalg.norm(answer.points[0] - points[0])
    inside = mesh.corners[answer.faces[0]]
    assert inside[:, 2].min() <= answer.points[0][2] <= inside[:, 2].max()
    return answer.points[0]


def test_a_point_below_the_upper_side_is_still_compared_with_it() -> None:
    assert search(plate(0.02), (0.4, 0.3, 0.001), (0, 0, 1))[2] == 0.02


def test_the_closest_point_stays_where_it_faces_the_same_way() -> None:
    assert search(plate(0.02), (0.4, 0.3, 0.001), (0, 0, -1))[2] == 0


def test_a_side_that_is_far_away_is_not_looked_for() -> None:
    assert search(plate(2 * REACH), (0.4, 0.3, 0.001), (0, 0, 1))[2] == 0


def test_where_nothing_faces_the_same_way_the_closest_point_stays() -> None:
    sheet = plate(0.02)
    only_lower = Mesh(sheet.vertices, sheet.faces[2:])

    assert search(only_lower, (0.4, 0.3, 0.001), (0, 0, 1))[2] == 0
