"""A rasteriser with a depth buffer: which triangle is seen at each pixel, and where on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


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
    """
    flat = points[faces][..., :2]
    # On screen y points down, which turns what faces the viewer clockwise.
    facing = np.flatnonzero(_cross(flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]) < 0)
    corners = points[faces[facing]]
    face, column, row = _candidates(corners[..., :2], size)
    centres = np.stack([column, row], axis=1).astype(np.float64) + 0.5
    weights = _barycentric(corners[face, :, :2], centres)
    inside = np.flatnonzero((weights >= 0).all(axis=1))
    face, pixel, weights = face[inside], (row * size + column)[inside], weights[inside]
    depth = np.einsum("pk,pk->p", weights, corners[face, :, 2])
    nearest = np.full(size * size, -1)
    farthest_first = np.argsort(depth)
    nearest[pixel[farthest_first]] = farthest_first  # of equal indices, the last one stays
    seen = nearest[nearest >= 0]
    return Fragments(pixel[seen], facing[face[seen]], weights[seen])


def _candidates(corners: Floats, size: int) -> tuple[Ints, Ints, Ints]:
    """Face, column and row of every pixel in each triangle's bounding box."""
    low = np.clip(np.floor(corners.min(axis=1)), 0, size).astype(np.int64)
    high = np.clip(np.ceil(corners.max(axis=1)), 0, size).astype(np.int64)
    width, height = (high - low).T
    counts = width * height
    face = np.repeat(np.arange(len(corners)), counts)
    within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    row, column = np.divmod(within, width[face])
    return face, low[face, 0] + column, low[face, 1] + row


def _barycentric(corners: Floats, centres: Floats) -> Floats:
    """(p, 3) coordinates of (p, 2) centres in (p, 3, 2) triangles of non-zero area."""
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    offset = centres - corners[:, 0]
    area = _cross(first, second)
    v, w = _cross(offset, second) / area, _cross(first, offset) / area
    return np.stack([1 - v - w, v, w], axis=1)


def _cross(left: Floats, right: Floats) -> Floats:
    return np.asarray(left[:, 0] * right[:, 1] - left[:, 1] * right[:, 0])
