"""How a text file writes its numbers, and how new ones are written so."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

_FEWEST_DIGITS = 6
_MOST_DIGITS = 17  # what it takes to write any float64 so that it reads back the same
_FEWEST_DECIMALS_OF_NORMALS = 4
_MOST_DECIMALS = 20


def steps_of_floats(positions: NDArray[np.float64], kind: np.dtype[Any]) -> NDArray[np.float64]:
    """(n,) how far apart numbers of a type are at positions (n, 3); 0 unless it is a float32."""
    if kind.kind != "f" or kind.itemsize != 4:
        return np.zeros(len(positions))
    with np.errstate(over="ignore", invalid="ignore"):
        largest = np.abs(positions).max(axis=1, initial=0.0).astype(np.float32)
        return np.asarray(np.spacing(largest), dtype=np.float64)


@dataclass(frozen=True)
class NumberStyle:
    """How a file writes its numbers.

    Attributes:
        fixed: always with the same number of decimals, zeros and all.
        digits: that number, or else the most significant digits any of them shows.
    """

    fixed: bool
    digits: int

    @staticmethod
    def of(words: Iterable[bytes]) -> NumberStyle:
        """The style of a sample of a file's numbers."""
        most = _FEWEST_DIGITS
        decimals: set[int] = set()
        for word in words:
            if word.lstrip(b"+-")[:1].lower() in (b"n", b"i"):  # nan and inf
                continue
            mantissa, exponent, _ = word.lower().partition(b"e")
            whole, _, fraction = mantissa.partition(b".")
            most = max(most, len((whole + fraction).lstrip(b"+-0")))
            decimals.add(len(fraction) if not exponent and fraction.isdigit() else 0)
        if len(decimals) == 1 and 0 < max(decimals) <= _MOST_DECIMALS:
            return NumberStyle(True, decimals.pop())
        return NumberStyle(False, min(most, _MOST_DIGITS))

    @property
    def format(self) -> bytes:
        """For the % operator."""
        return b"%%.%d%s" % (self.digits, b"f" if self.fixed else b"g")

    def steps(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """(n,) how far apart the numbers are that it writes for positions (n, 3)."""
        if self.fixed:
            return np.full(len(positions), 10.0**-self.digits)
        if self.digits >= _MOST_DIGITS - 1:  # those of a float64
            return np.zeros(len(positions))
        largest = np.maximum(np.abs(positions).max(axis=1, initial=0.0), 1e-300)
        return np.asarray(10.0 ** (np.floor(np.log10(largest)) + 1 - self.digits))

    def resolving(self, positions: NDArray[np.float64]) -> NumberStyle:
        """The same style with as many digits as positions (n, 3) of this size need.

        A model far from the origin, or very small, needs more than its author's file may
        have shown: a file that does not resolve a millionth of its size gets to resolve a
        ten-millionth.
        """
        span = float(np.ptp(positions, axis=0).max())
        reach = float(np.abs(positions).max())
        if not 0 < span < np.inf:
            return self
        if not self.fixed:
            needed = int(np.clip(np.ceil(np.log10(reach / span)) + 7, 0, _MOST_DIGITS))
            return replace(self, digits=max(self.digits, needed))
        if 10.0**-self.digits <= 1e-6 * span:
            return self
        needed = int(np.ceil(7 - np.log10(span)))
        style = NumberStyle(True, needed)
        return style if needed <= _MOST_DECIMALS else NumberStyle(False, _MOST_DIGITS)

    def for_normals(self) -> NumberStyle:
        """The same style with as many digits as a direction needs."""
        if self.fixed:
            return replace(self, digits=max(self.digits, _FEWEST_DECIMALS_OF_NORMALS))
        return self
