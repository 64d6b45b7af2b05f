"""What animations do, as far as another exporter keeps it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.content import Channel

_SAME = 0.01  # of the largest value; of a unit quaternion


@dataclass(frozen=True)
class Track:
    """The course of one channel.

    Attributes:
        path: what it moves.
        samples: (s, c) its values, evenly from its first key to its last; None where there are not
            as many values as its keys need.
    """

    path: str
    samples: NDArray[np.float64] | None

    @staticmethod
    def of(channel: Channel) -> Track:
        """The course of a channel."""
        return Track(channel.path, channel.track)

    def is_like(self, other: Track) -> bool:
        """Whether both go the same way, but for rounding and for when keys are set."""
        here, there = self.samples, other.samples
        if here is None or there is None:
            return here is there
        if here.shape != there.shape:
            return False
        if self.path == "rotation":  # q and -q are one turn
            there = np.where((here * there).sum(axis=1, keepdims=True) < 0, -there, there)
        largest = max(float(np.abs(here).max(initial=0.0)), float(np.abs(there).max(initial=0.0)))
        return bool(np.abs(here - there).max(initial=0.0) <= _SAME * largest)

    def words(self) -> str:
        """The values at the beginning, in the middle and at the end."""
        if self.samples is None:
            return "values that do not fit the keys"
        told = self.samples[[0, len(self.samples) // 2, -1]]
        return ", then ".join(f"({', '.join(f'{v:.3g}' for v in row[:4])})" for row in told)
