"""Scrambled Sobol points."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import qmc

from meshcone.surface.sobol import sobol_points


@pytest.mark.parametrize("exponent", [0, 1, 2, 7, 13])
@pytest.mark.parametrize("seed", [0, 1, 2, 1234567])
def test_the_points_are_scipys_bit_for_bit(exponent: int, seed: int) -> None:
    sequence = qmc.Sobol(3, scramble=True, rng=np.random.default_rng(seed))

    np.testing.assert_array_equal(sobol_points(exponent, seed), sequence.random_base2(exponent))


def test_in_each_direction_every_interval_has_one_point() -> None:
    points = sobol_points(10, 5)

    assert points.shape == (1024, 3)
    for coordinate in points.T:
        assert sorted((coordinate * 1024).astype(int)) == list(range(1024))
