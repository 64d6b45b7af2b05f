"""Texture coordinates drawn as texels: what overlaps, what is unused, how far islands are apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from meshcone.auditing.coverage import coverage, texels_in_boxes
from meshcone.surface.arrays import Bools, Floats

RESOLUTION = 1024
"""Texels along a side, at which overlap, unused share and gutters are found."""

WIDEST_GUTTER = 64  # texels

_SMALLEST_RESOLUTION = 64
_MOST_CENTRES = 20_000_000  # of all sets and materials together, about 40 ns each


def resolutions(drawn: Sequence[Floats]) -> list[int | None]:
    """At how many texels along a side each of some charts is drawn; None: not at all.

    All of them together take bounded work: those that take little have what they need, the
    others share what is left.

    Args:
        drawn: (m, 3, 2) coordinates of each.
    """
    needs = [texels_in_boxes(uv, RESOLUTION) for uv in drawn]
    most, left = 0.0, float(_MOST_CENTRES)
    for done, need in enumerate(sorted(needs)):
        most = left / (len(needs) - done)
        left -= min(need, most)
    return [_resolution(uv, most) for uv in drawn]


def _resolution(uv: Floats, most: float) -> int | None:
    size = RESOLUTION
    while size >= _SMALLEST_RESOLUTION and texels_in_boxes(uv, size) > most:
        size //= 2
    return size if len(uv) and size >= _SMALLEST_RESOLUTION else None


@dataclass(frozen=True)
class Raster:
    """What drawing a chart says.

    Attributes:
        size: texels along a side.
        overlap: share of the covered texels that more than one triangle covers.
        unused: share of all that none does.
        gutter: texels between the two islands that are closest; None where a coarse raster
            does not say: islands less than a texel apart are one there.
    """

    size: int
    overlap: float
    unused: float
    gutter: int | None

    @staticmethod
    def of(uv: Floats, size: int) -> Raster:
        """Draw triangles.

        Args:
            uv: (m, 3, 2) coordinates.
            size: texels along a side.
        """
        counts = coverage(uv, size)
        used = int(np.count_nonzero(counts))
        return Raster(
            size=size,
            overlap=int(np.count_nonzero(counts > 1)) / max(used, 1),
            unused=1 - used / counts.size,
            gutter=_gutter(counts > 0) if size == RESOLUTION else None,
        )


def _gutter(covered: Bools) -> int:
    """Texels between the two islands that are closest, up to 64.

    Islands are what covers texels that touch. Where there is one alone, or two are farther
    apart than 64 texels, the answer is 64.
    """
    rows, columns = (np.flatnonzero(covered.any(axis=axis)) for axis in (1, 0))
    if len(rows) == 0:
        return WIDEST_GUTTER
    covered = covered[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    labels, islands = ndimage.label(covered, structure=np.ones((3, 3)))
    if islands < 2:
        return WIDEST_GUTTER
    nearest = ndimage.distance_transform_cdt(
        ~covered, metric="chessboard", return_distances=True, return_indices=True
    )
    distances, indices = nearest
    owner = labels[tuple(indices)]
    narrowest = WIDEST_GUTTER
    # Two islands are closest where the texels nearest to either meet.
    for axis in (0, 1):
        here, there = [slice(None)] * 2, [slice(None)] * 2
        here[axis], there[axis] = slice(None, -1), slice(1, None)
        borders = owner[tuple(here)] != owner[tuple(there)]
        if borders.any():
            between = (distances[tuple(here)] + distances[tuple(there)])[borders]
            narrowest = min(narrowest, int(between.min()))
    return narrowest
