"""Reading a texture at texture coordinates, as a GPU does at its finest level."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.content import TextureUse
from meshcone.assets.content.records import Wrap
from meshcone.srgb import to_linear
from meshcone.surface.arrays import Floats, Ints

# Of 8-bit channels: three of sRGB colour in linear light, and alpha, which is linear.
_LINEAR = to_linear(np.arange(256) / 255)
_PLAIN = np.arange(256) / 255
_FARTHEST = 2.0**52  # texels: beyond, a double has no fraction and int64 soon no room


def sample(pixels: NDArray[np.uint8], use: TextureUse, coordinates: Floats) -> Floats:
    """Linear RGBA (k, 4) of an image at coordinates (k, 2) that are already placed.

    Interpolated between the four texels around, in linear light, or the nearest of them as the
    sampler says. Coordinates that are no numbers count as 0.

    Args:
        pixels: (h, w, 4) sRGB and alpha, as encoded.
        use: how it is read.
        coordinates: u to the right and v downwards, the image from 0 to 1.
    """
    height, width = pixels.shape[:2]
    known = np.where(np.isfinite(coordinates), coordinates, 0.0)
    with np.errstate(over="ignore"):
        place = np.clip(known * (width, height), -_FARTHEST, _FARTHEST)
    if use.nearest:
        column, row = np.floor(place).astype(np.int64).T
        return _texels(pixels, use, column, row)
    corner = np.floor(place - 0.5)
    right, down = (place - 0.5 - corner).T[..., None]
    column, row = corner.astype(np.int64).T
    upper = (1 - right) * _texels(pixels, use, column, row)
    upper += right * _texels(pixels, use, column + 1, row)
    lower = (1 - right) * _texels(pixels, use, column, row + 1)
    lower += right * _texels(pixels, use, column + 1, row + 1)
    return np.asarray((1 - down) * upper + down * lower)


def _texels(pixels: NDArray[np.uint8], use: TextureUse, column: Ints, row: Ints) -> Floats:
    height, width = pixels.shape[:2]
    across, along = use.wrap
    found = pixels[_wrapped(row, height, along), _wrapped(column, width, across)]
    return np.concatenate([_LINEAR[found[:, :3]], _PLAIN[found[:, 3:]]], axis=1)


def _wrapped(index: Ints, count: int, wrap: Wrap) -> Ints:
    if wrap == "clamp":
        return index.clip(0, count - 1)
    if wrap == "repeat":
        return index % count
    there_and_back = index % (2 * count)
    return np.minimum(there_and_back, 2 * count - 1 - there_and_back)
