"""Points sorted along a curve that fills space."""

from __future__ import annotations

import numpy as np

from meshcone.surface.ordering import spatial_order


def test_the_eight_corners_of_a_cube_come_in_the_curves_order():
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)

    ordered = corners[spatial_order(corners)]

    expected = [[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    np.testing.assert_array_equal(ordered, expected)


def test_neighbours_in_the_order_are_near_each_other_in_space():
    points = np.random.default_rng(0).uniform(size=(4096, 3))

    steps = np.linalg.norm(np.diff(points[spatial_order(points)], axis=0), axis=1)

    assert steps.mean() < 0.2 * np.linalg.norm(np.diff(points, axis=0), axis=1).mean()


def test_every_point_comes_once():
    points = np.random.default_rng(0).normal(size=(100, 3))

    assert sorted(spatial_order(points)) == list(range(100))


def test_no_points_and_equal_points_have_an_order_too():
    assert len(spatial_order(np.zeros((0, 3)))) == 0
    np.testing.assert_array_equal(spatial_order(np.ones((3, 3))), [0, 1, 2])
