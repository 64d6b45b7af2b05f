"""A rasteriser with a depth buffer: which triangle is seen at each pixel, and where on it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from meshcone.surface.arrays import Floats, Ints

_AT_ONCE = 1 << 20  # pixels in boxes of triangles, about 100 bytes each
_STEPS = (1 << 30) - 1  # of depth that are told apart
_MOST = 100_000_000  # pixels in boxes of triangles, some ten seconds


class OverdrawError(Exception):
    """The triangles cover the image too many times to be drawn in bounded time."""


@dataclass(frozen=True)
class Fragments:
    """What is seen, one row for each pixel that sees anything.

    Attributes:
        pixels: (p,) row-major pixel numbers, each at most once.
        faces: (p,) the nearest face there.
        weights: (p, 3) barycentric coordinates of the pixel's centre in that face.
    """

    pixels: Ints
    faces: Ints
    weights: Floats

    def interpolate(self, values: Floats, faces: Ints) -> Floats:
        """Spread (n, c) values at vertices over the pixels, (p, c)."""
        corners = values[faces[self.faces]]
        return np.asarray(np.einsum("pk,pkc->pc", self.weights, corners))


def rasterize(points: Floats, faces: Ints, size: int) -> Fragments:
    """Draw the triangles that face the viewer into a square image.

    Args:
        points: (n, 3) x to the right and y downwards in pixels, z towards the viewer.
        faces: (m, 3) vertex indices, counter-clockwise seen from outside.
        size: width and height in pixels; what lies beyond is cut off.

    Raises:
        OverdrawError: their boxes have more than 100 million pixels together.
    """
    # On screen y points down, which turns what faces the viewer clockwise.
    facing = np.flatnonzero(_turns(points[faces]) < 0)
    nearest, _ = both_ends(points, faces[facing], size)
    return Fragments(nearest.pixels, facing[nearest.faces], nearest.weights)


def both_ends(points: Floats, faces: Ints, size: int) -> tuple[Fragments, Fragments]:
    """Draw all triangles, whichever way they face: what is nearest, and what is farthest.

    The farthest are what is seen from behind, in an image that is not mirrored.

    Args:
        points: as for :func:`rasterize`.
        faces: (m, 3) vertex indices, in either order.
        size: as for :func:`rasterize`.

    Raises:
        OverdrawError: as :func:`rasterize`.
    """
    corners = points[faces]
    drawn = np.flatnonzero(_turns(corners) != 0)
    corners = corners[drawn]
    low, high = (float(edge) for edge in (points[:, 2].min(), points[:, 2].max()))
    scale = _STEPS / (high - low or 1.0)
    kept: list[tuple[Ints, Ints, Floats]] = []
    for face, pixel, weights in _inside(corners[..., :2], size):
        depth = np.einsum("pk,pk->p", weights, corners[face, :, 2])
        steps = ((depth - low) * scale).clip(0, _STEPS).astype(np.int64)
        kept.append(_ends((pixel << 30) | steps, face, weights))
        if len(kept) > 1:
            keys, owners, places = map(np.concatenate, zip(*kept, strict=True))
            kept = [_ends(keys, owners, places)]
    if not kept:
        nothing = Fragments(*(np.empty(0, np.int64),) * 2, np.empty((0, 3)))
        return nothing, nothing
    [(keys, owners, places)] = kept
    pixels = keys >> 30
    first = np.flatnonzero(np.diff(pixels, prepend=-1) != 0)
    last = np.flatnonzero(np.diff(pixels, append=-1) != 0)
    nearest, farthest = (
        Fragments(pixels[which], drawn[owners[which]], places[which]) for which in (last, first)
    )
    return nearest, farthest


def _ends(keys: Ints, faces: Ints, weights: Floats) -> tuple[Ints, Ints, Floats]:
    """Sort fragments by pixel and depth, and keep the first and last of each pixel."""
    order = np.argsort(keys, kind="stable")
    pixels = keys[order] >> 30
    ends = (np.diff(pixels, prepend=-1) != 0) | (np.diff(pixels, append=-1) != 0)
    order = order[ends]
    return keys[order], faces[order], weights[order]


def _inside(corners: Floats, size: int) -> Iterator[tuple[Ints, Ints, Floats]]:
    """Face, pixel and barycentric coordinates of the pixels inside (m, 3, 2) triangles."""
    low = np.clip(np.floor(corners.min(axis=1)), 0, size).astype(np.int64)
    high = np.clip(np.ceil(corners.max(axis=1)), 0, size).astype(np.int64)
    boxes = np.cumsum((high - low).prod(axis=1))
    if len(boxes) and boxes[-1] > _MOST:
        raise OverdrawError
    begin = 0
    while begin < len(corners):
        limit = (boxes[begin - 1] if begin else 0) + _AT_ONCE
        end = max(begin + 1, int(np.searchsorted(boxes, limit, side="right")))
        rows = low[begin:end, 1], high[begin:end, 1]
        face, pixel, weights = _scanned(corners[begin:end], *rows, size)
        if len(face):
            yield face + begin, pixel, weights
        begin = end


def _scanned(corners: Floats, first: Ints, end: Ints, size: int) -> tuple[Ints, Ints, Floats]:
    """Pixels inside triangles of non-zero area, row by row.

    Along a row each barycentric coordinate is linear: where all three are positive is a span
    of pixels.

    Args:
        corners: (m, 3, 2).
        first: (m,) row in which each begins.
        end: (m,) row before which it ends.
        size: pixels in a row.
    """
    slope, rise, start = _linear(corners)
    face, row = _spread(first, end)
    at_zero = rise[face] * (row + 0.5)[:, None] + start[face]
    along = slope[face]
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = -at_zero / along
    left = np.where(along > 0, crossing, np.where((along == 0) & (at_zero < 0), np.inf, -np.inf))
    right = np.where(along < 0, crossing, np.inf)
    begins = np.ceil(left.max(axis=1) - 0.5).clip(0, size).astype(np.int64)
    ends = (np.floor(right.min(axis=1) - 0.5) + 1).clip(0, size).astype(np.int64)
    span, column = _spread(begins, np.maximum(begins, ends))
    weights = along[span] * (column + 0.5)[:, None] + at_zero[span]
    return face[span], row[span] * size + column, weights.clip(0, 1)


def _spread(first: Ints, end: Ints) -> tuple[Ints, Ints]:
    """All numbers from ``first`` to before ``end`` (m,), after which of the m each belongs to."""
    counts = end - first
    owner = np.repeat(np.arange(len(first)), counts)
    within = np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
    return owner, first[owner] + within


def _linear(corners: Floats) -> tuple[Floats, Floats, Floats]:
    """Barycentric coordinates over the plane: what they change by along x, along y, and at 0.

    (m, 3) each, of (m, 3, 2) triangles of non-zero area.
    """
    x, y = corners[..., 0], corners[..., 1]
    after, before = np.roll(x, -1, axis=1), np.roll(x, -2, axis=1)
    above, below = np.roll(y, -1, axis=1), np.roll(y, -2, axis=1)
    area = _turns(corners)[:, None]
    slope, rise = (above - below) / area, (before - after) / area
    return slope, rise, (after * below - before * above) / area


def _turns(corners: Floats) -> Floats:
    """Twice the signed area of (m, 3, ≥ 2) triangles on the screen, (m,)."""
    return _cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def _cross(left: Floats, right: Floats) -> Floats:
    return np.asarray(left[:, 0] * right[:, 1] - left[:, 1] * right[:, 0])
