"""How often each texel of a texture is covered by triangles in texture space.

Texture coordinates are snapped to 1/256 of a texel, as GPUs do, and everything after that is
exact in whole numbers. A centre that lies on an edge belongs to one of the triangles that share
it, by the top-left rule (Direct3D 11 functional specification, section 3.4.1).
"""

from __future__ import annotations

import numpy as np

from meshcone.surface.arrays import Floats, Ints

_STEPS = 256  # of a texel
_CANDIDATES = 2_000_000  # centres tested at once, about 40 bytes each
_LARGEST = 2.0**20  # tiles from the origin; beyond it a file means nothing by its coordinates


def coverage(uv: Floats, size: int) -> Ints:
    """(size, size) number of triangles over the centre of each texel.

    Triangles outside 0 to 1 cover what they repeat. Time and memory grow with the texels in
    the boxes around the triangles; see :func:`texels_in_boxes`.

    Args:
        uv: (m, 3, 2) finite texture coordinates.
        size: texels along each side.
    """
    fixed = _snapped(uv, size)
    edges = _Edges(fixed)
    low, counts = edges.boxes()
    counts_each = counts.prod(axis=1)
    covered = np.zeros(size * size, dtype=np.int64)
    ends = np.cumsum(counts_each)
    first = 0
    while first < len(counts_each):
        done = ends[first] - counts_each[first]
        last = max(int(np.searchsorted(ends, done + _CANDIDATES, side="right")), first + 1)
        chosen = slice(first, last)
        triangle, x, y = _centres(low[chosen], counts[chosen])
        inside = edges.hold(triangle + first, x, y)
        texels = (y[inside] % size) * size + x[inside] % size
        covered += np.bincount(texels, minlength=size * size)
        first = last
    return covered.reshape(size, size)


def texels_in_boxes(uv: Floats, size: int) -> float:
    """How many centres :func:`coverage` would have to test."""
    extents = np.ptp(uv, axis=1) * size + 1
    return float(extents.prod(axis=1).sum())


def _snapped(uv: Floats, size: int) -> Ints:
    """(m, 3, 2) coordinates in 1/256 texel, with an area and counter-clockwise."""
    near = uv - np.floor(uv.min(axis=1, keepdims=True).clip(-_LARGEST, _LARGEST))
    fixed = np.rint(near.clip(-_LARGEST, _LARGEST) * (size * _STEPS)).astype(np.int64)
    side, other = fixed[:, 1] - fixed[:, 0], fixed[:, 2] - fixed[:, 0]
    doubled = side[:, 0] * other[:, 1] - side[:, 1] * other[:, 0]
    turned = np.where((doubled < 0)[:, None, None], fixed[:, [0, 2, 1]], fixed)
    return np.asarray(turned[doubled != 0])


class _Edges:
    """The lines along the sides of triangles: a·x + b·y + c ≥ 0 inside."""

    def __init__(self, fixed: Ints) -> None:
        self._fixed = fixed
        following = np.roll(fixed, -1, axis=1)
        self._a = fixed[..., 1] - following[..., 1]
        self._b = following[..., 0] - fixed[..., 0]
        is_top_left = (self._a > 0) | ((self._a == 0) & (self._b > 0))
        on_line = self._a * fixed[..., 0] + self._b * fixed[..., 1]
        self._c = np.where(is_top_left, 0, -1) - on_line

    def boxes(self) -> tuple[Ints, Ints]:
        """(m, 2) first centre in each triangle's box, and how many along each side."""
        half = _STEPS // 2
        low = -((half - self._fixed.min(axis=1)) // _STEPS)
        high = (self._fixed.max(axis=1) - half) // _STEPS
        return low, np.maximum(high - low + 1, 0)

    def hold(self, triangle: Ints, x: Ints, y: Ints) -> np.ndarray:
        """(k,) whether the centre of texel x, y is in a triangle."""
        half = _STEPS // 2
        at_x, at_y = x * _STEPS + half, y * _STEPS + half
        inside = np.ones(len(triangle), dtype=bool)
        for side in range(3):
            a, b, c = (values[triangle, side] for values in (self._a, self._b, self._c))
            inside &= a * at_x + b * at_y + c >= 0
        return inside


def _centres(low: Ints, counts: Ints) -> tuple[Ints, Ints, Ints]:
    """Triangle, x and y of every centre in some boxes."""
    total = counts.prod(axis=1)
    triangle = np.repeat(np.arange(len(total)), total)
    within = np.arange(len(triangle)) - np.repeat(np.cumsum(total) - total, total)
    y, x = np.divmod(within, counts[triangle, 0])
    return triangle, x + low[triangle, 0], y + low[triangle, 1]
