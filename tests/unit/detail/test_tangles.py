"""Faces that pass through others where they did not before faces were added."""

from __future__ import annotations

import numpy as np

from meshcone.detail.tangles import are_many, new_tangles
from meshcone.surface import Mesh

# A triangle in the plane, and one that stands beside it.
REST = Mesh(
    np.array([[0.0, 0, 0], [4, 0, 0], [0, 4, 0], [9, 1, -1], [9, 2, -1], [9, 1, 1]]),
    np.array([[0, 1, 2], [3, 4, 5]]),
)
THROUGH = REST.vertices - np.array([[0.0, 0, 0]] * 3 + [[8, 0, 0]] * 3)


def test_pairs_that_come_to_pass_through_each_other_are_counted() -> None:
    assert new_tangles(REST, REST.vertices, 100) == 0
    assert new_tangles(REST, THROUGH, 100) == 1


def test_pairs_that_did_so_at_rest_are_not() -> None:
    tangled = REST.moved_to(THROUGH)
    assert new_tangles(tangled, THROUGH, 100) == 0
    assert new_tangles(tangled, REST.vertices, 100) == 0


def test_one_in_a_thousand_faces_is_not_many() -> None:
    assert not are_many(1, 1000)
    assert are_many(2, 1000)
