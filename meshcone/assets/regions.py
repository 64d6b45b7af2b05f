"""Which part of a file each triangle belongs to: its material and group."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.weld import group_equal_rows

_NAME_LENGTH = 60


@dataclass(frozen=True)
class Regions:
    """A partition of triangles.

    Attributes:
        labels: (k,) region of each triangle, an index into ``names``.
        names: what a message calls each region.
    """

    labels: NDArray[np.int64]
    names: tuple[str, ...]

    @staticmethod
    def whole(triangles: int) -> Regions:
        """One region without a name, for formats that know no parts."""
        return Regions(np.zeros(triangles, dtype=np.int64), ("",))


def combine_parts(parts: list[list[str]], chosen: NDArray[np.int64]) -> Regions:
    """Make a region of every combination of parts that occurs, in the order of appearance.

    Args:
        parts: for each way the file is divided, the names of its parts; an empty name is
            left out of the region's, a long one cut: regions can be many times as many
            as the names they are made of.
        chosen: (k, len(parts)) which part of each division a triangle belongs to.
    """
    labels, first_rows = group_equal_rows(chosen.astype(np.float64))
    names = tuple(
        " / ".join(
            name[:_NAME_LENGTH]
            for division, part in zip(parts, chosen[row].tolist(), strict=True)
            if (name := division[part])
        )
        for row in first_rows.tolist()
    )
    return Regions(labels, names)
