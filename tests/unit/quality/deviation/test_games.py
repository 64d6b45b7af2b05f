"""Mixing the distances to several faces, against a linear program."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linprog

from meshcone.quality.deviation.games import mix_distances, mixed_bound

TABLES = st.integers(0, 2**32 - 1).map(
    lambda seed: np.random.default_rng(seed).uniform(0, 1, size=(3, 4, 20))
)


def value_of_game(distances: np.ndarray) -> float:
    """Least of max_i Σ_k μ_k D[i, k] over all weights μ."""
    corners, faces = distances.shape
    cost = np.append(np.zeros(faces), 1.0)
    found = linprog(
        cost,
        A_ub=np.column_stack([distances, -np.ones(corners)]),
        b_ub=np.zeros(corners),
        A_eq=np.append(np.ones(faces), 0.0)[None],
        b_eq=[1.0],
    )
    return float(found.fun)


@given(TABLES)
def test_the_bound_is_the_value_of_the_game(distances: np.ndarray) -> None:
    bound, weights = mixed_bound(distances)

    best = [value_of_game(distances[:, :, piece]) for piece in range(distances.shape[2])]
    np.testing.assert_allclose(bound, best, atol=1e-6)
    np.testing.assert_array_equal(bound, mix_distances(distances, weights).max(axis=0))


@pytest.mark.parametrize("faces", [3, 4])
@given(TABLES)
def test_with_what_the_first_faces_give_the_rest_is_enough(
    faces: int, distances: np.ndarray
) -> None:
    table = distances[:, :faces]
    first, _ = mixed_bound(table[:, : faces - 1])
    rest, _ = mixed_bound(table, tried=faces - 1)
    whole, _ = mixed_bound(table)

    np.testing.assert_allclose(np.minimum(first, rest), whole, atol=1e-6)
