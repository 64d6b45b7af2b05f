from __future__ import annotations

import numpy as np

from meshcone.assets.weld import weld_surface


def test_equal_positions_become_one_vertex_in_the_order_they_appear():
    positions = np.array([[1.0, 0, 0], [0, 0, 0], [0, 1, 0], [0, 0, 0], [0, 1, 0], [0, 0, 1]])
    surface = weld_surface(positions, np.array([[0, 1, 2], [3, 4, 5]]))
    assert surface.weld.tolist() == [0, 1, 2, 1, 2, 3]
    assert surface.vertices.tolist() == [[1, 0, 0], [0, 0, 0], [0, 1, 0], [0, 0, 1]]
    assert surface.faces.tolist() == [[0, 1, 2], [1, 2, 3]]


def test_negative_zero_equals_zero():
    positions = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [-0.0, -0.0, 0], [0, 0, 1], [1, 0, 1]])
    surface = weld_surface(positions, np.array([[0, 1, 2], [3, 4, 5]]))
    assert surface.weld[3] == surface.weld[0]


def test_the_smallest_difference_keeps_vertices_apart():
    positions = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [np.nextafter(1, 2), 0, 0], [0, 0, 1]])
    surface = weld_surface(positions, np.array([[0, 1, 2], [0, 3, 4]]))
    assert surface.weld[1] != surface.weld[3]


def test_unused_vertices_have_no_welded_vertex():
    positions = np.array([[9.0, 9, 9], [0, 0, 0], [1, 0, 0], [0, 1, 0]])
    surface = weld_surface(positions, np.array([[1, 2, 3]]))
    assert surface.weld.tolist() == [-1, 0, 1, 2]


def test_a_face_that_collapses_is_dropped_with_the_vertices_only_it_used():
    positions = np.array([[5.0, 5, 5], [5, 5, 5], [6, 6, 6], [0, 0, 0], [1, 0, 0], [0, 1, 0]])
    surface = weld_surface(positions, np.array([[0, 1, 2], [3, 4, 5]]))
    assert surface.faces.tolist() == [[0, 1, 2]]
    assert surface.kept.tolist() == [1]
    assert surface.weld.tolist() == [-1, -1, -1, 0, 1, 2]
