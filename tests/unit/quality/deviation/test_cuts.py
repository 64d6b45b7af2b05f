"""Where pieces are cut."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.quality.deviation.cuts import choose_cuts

PIECE = np.array([[[0.0, 0, 0], [4, 0, 0], [0, 3, 0]]])
FAR_AWAY = np.array([9.0])


def cut(
    distances: list[list[float]], *, depth: int = 1, face: np.ndarray = PIECE, far: bool = True
) -> tuple[int, float]:
    """The edge and the share of it, by the distances of three corners to each face."""
    table = np.array(distances).T[:, :, None]
    centre = FAR_AWAY if far else np.zeros(1)
    edges, shares = choose_cuts(PIECE, table, centre, face, np.array([depth]), creases=True)
    return int(edges[0]), float(shares[0])


def test_a_piece_is_cut_where_the_bounds_of_two_faces_cross_on_an_edge():
    assert cut([[1.0, 5.0, 1.0], [7.0, 3.0, 1.0]]) == (0, pytest.approx(0.75))


def test_where_one_face_bounds_it_best_a_piece_is_cut_where_it_leaves_the_prism_over_a_face():
    lower = PIECE + np.array([0, 0, -1.0])
    half = lower.copy()
    half[0, 1, 0] = 1.0

    assert cut([[1.0, 1.0, 1.0]], face=half, far=False) == (0, pytest.approx(0.25))


def test_a_piece_over_the_inside_of_a_face_is_cut_in_the_middle_of_its_longest_edge():
    assert cut([[1.0, 1.0, 1.0]], face=PIECE * 3 - 1, far=False) == (1, 0.5)


def test_every_twelfth_cut_is_in_the_middle():
    assert cut([[1.0, 5.0, 1.0], [7.0, 3.0, 1.0]], depth=11) == (1, 0.5)
