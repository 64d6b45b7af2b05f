"""Which edges are split for a number of faces."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.detail.choosing import choose_edges
from meshcone.detail.divided_mesh import DividedMesh, edge_of_sides
from meshcone.detail.misses import Misses
from meshcone.surface import Mesh
from tests import shapes

BALL = Mesh(*shapes.sphere(2))
ONCE = np.ones(len(BALL.faces), dtype=np.int64)
ANY = np.ones(len(BALL.edges), dtype=bool)


def misses(mesh: Mesh, scores: np.ndarray, sides: np.ndarray | None = None) -> Misses:
    equal = np.ones((len(mesh.faces), 3))
    return Misses(scores, equal if sides is None else sides, mean=1.0, farthest=1.0)


@pytest.mark.parametrize("most", [128, 129, 131, 200, 256, 400])
def test_no_more_faces_result_than_are_allowed(most: int) -> None:
    scores = np.random.default_rng(0).random(len(BALL.faces))
    marked = choose_edges(BALL, misses(BALL, scores), ANY, most, ONCE)
    faces = len(DividedMesh.of(BALL).split(marked).mesh.faces)
    assert faces <= most
    assert faces >= min(most, 250) - 3  # one side of each face, at most, is split


def test_the_face_to_blame_for_most_is_split_first() -> None:
    scores = np.zeros(len(BALL.faces))
    scores[17] = 1.0
    marked = choose_edges(BALL, misses(BALL, scores), ANY, 1000, ONCE)
    assert marked.sum() == 1
    assert marked[edge_of_sides(BALL)[17]].any()


def test_a_side_is_split_where_its_middle_is_farthest_off() -> None:
    scores, sides = np.zeros(len(BALL.faces)), np.ones((len(BALL.faces), 3))
    scores[5], sides[5] = 1.0, [0.0, 0.0, 3.0]
    marked = choose_edges(BALL, misses(BALL, scores, sides), ANY, 1000, ONCE)
    assert marked[edge_of_sides(BALL)[5, 2]]


def test_a_short_side_is_not_split_before_the_longest() -> None:
    sliver = Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [0.9, 0.1, 0]]), np.array([[0, 1, 2]]))
    found = misses(sliver, np.ones(1), np.array([[0.0, 5.0, 0.0]]))
    marked = choose_edges(sliver, found, np.ones(3, dtype=bool), 10, ONCE[:1])
    assert marked[edge_of_sides(sliver)[0, 0]]
    assert marked.sum() == 1


def test_what_may_not_be_split_is_not() -> None:
    marked = choose_edges(BALL, misses(BALL, np.ones(len(BALL.faces))), ~ANY, 1000, ONCE)
    assert not marked.any()


def test_a_face_that_stands_for_several_counts_as_many_times() -> None:
    found = misses(BALL, np.ones(len(BALL.faces)))
    marked = choose_edges(BALL, found, ANY, 3 * 150, 3 * ONCE)
    assert len(DividedMesh.of(BALL).split(marked).mesh.faces) <= 150
