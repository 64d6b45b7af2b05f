"""Scrambled Sobol points in the unit cube.

The points are those of SciPy's ``qmc.Sobol``, bit for bit. Importing that takes a fifth of the
time that importing the whole engine does, for the distributions that come along.
"""

from __future__ import annotations

import numpy as np

from meshcone.surface.arrays import Floats, Ints

_BITS = 30  # of a coordinate
# A primitive polynomial over GF(2) and the first direction numbers of each dimension but the
# first (Joe and Kuo, "Constructing Sobol sequences with better two-dimensional projections", 2008).
_POLYNOMIALS = ((0b11, (1,)), (0b111, (1, 3)))
_DIMENSIONS = 1 + len(_POLYNOMIALS)


def sobol_points(exponent: int, seed: int) -> Floats:
    """Draw the first points of a Sobol sequence, which are balanced over powers of two.

    Scrambled by a random linear matrix and a digital shift (Matoušek, "On the L2-discrepancy
    for anchored boxes", 1998), in the order of the Gray code (Antonov and Saleev, 1979).

    Args:
        exponent: of two; there are so many points, at most 2³⁰.
        seed: the same seed gives the same points.

    Returns:
        (2 ** exponent, 3) in [0, 1).
    """
    # A child of the seed, as SciPy has it.
    random = np.random.default_rng(seed).spawn(1)[0]
    weights = 2 ** np.arange(_BITS)
    shift = random.integers(2, size=(_DIMENSIONS, _BITS), dtype=np.uint32) @ weights
    matrices = random.integers(2, size=(_DIMENSIONS, _BITS, _BITS), dtype=np.uint32)
    steps = _scrambled(_direction_numbers(), np.tril(matrices).astype(np.int64))
    points = np.empty((2**exponent, _DIMENSIONS), dtype=np.int32)  # which holds 30 bits
    points[0] = shift
    for bit, step in enumerate(steps.T[:exponent].astype(np.int32)):
        half = 2**bit  # the second half of a Gray code is the first one mirrored
        np.bitwise_xor(points[half - 1 :: -1], step, out=points[half : 2 * half])
    return points * 0.5**_BITS


def _direction_numbers() -> Ints:
    """By dimension and bit, (3, 30), as whole numbers of 30 bits."""
    found = np.ones((_DIMENSIONS, _BITS), dtype=np.int64)
    for row, (polynomial, first) in zip(found[1:], _POLYNOMIALS, strict=True):
        degree = len(first)
        row[:degree] = first
        for bit in range(degree, _BITS):
            row[bit] = row[bit - degree]
            for back in range(1, degree + 1):
                if polynomial >> (degree - back) & 1:
                    row[bit] ^= row[bit - back] << back
    return found << np.arange(_BITS - 1, -1, -1)


def _scrambled(numbers: Ints, matrices: Ints) -> Ints:
    """Multiply the digits of numbers (d, k) by lower triangular matrices (d, 30, 30) over GF(2).

    Their diagonals count as ones. Digits are taken from the largest to the smallest.
    """
    matrices = matrices | np.eye(_BITS, dtype=matrices.dtype)
    places = np.arange(_BITS - 1, -1, -1)
    digits = numbers[:, None, :] >> places[:, None] & 1
    return np.asarray((((matrices @ digits) & 1) << places[:, None]).sum(axis=1))
