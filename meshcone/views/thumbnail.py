"""A small picture of a mesh, for lists: seen from front, right and above, as WebP."""

from __future__ import annotations

import io
import math

import numpy as np
from PIL import Image

from meshcone.appearance.paint import Paint, Spots, shown
from meshcone.srgb import to_encoded
from meshcone.surface import Mesh
from meshcone.surface.arrays import Floats
from meshcone.views.raster import Fragments, OverdrawError, both_ends

SIZE = 112
"""Width and height, in pixels."""

_FINER = 2  # drawn larger by this, then averaged, which smooths outlines
_MARGIN = 1.04
_YAW, _PITCH = math.radians(-35), math.radians(25)
_LAMP = (-0.35, -0.55, 0.76)  # towards the light: left of the viewer and above
_AMBIENT, _DIRECT = 0.3, 0.75
_PLAIN = (0.42, 0.52, 0.56)  # linear light of what has no known colour
_QUALITY = 80


def thumbnail_webp(mesh: Mesh, paint: Paint | None = None) -> bytes | None:
    """Draw a mesh, wherever it lies and however large it is.

    What is not covered is transparent. Faces are seen from both sides, and each is lit as if it
    were flat. Colours are shown where they can be had without decoding an image now.

    Args:
        mesh: with y up.
        paint: its colours, if they are known.

    Returns:
        None where the mesh has no extent, or covers the picture too many times.
    """
    seen = _seen(mesh)
    if seen is None or len(seen.pixels) == 0:
        return None
    light = _colours(seen, paint) * _brightness(mesh, seen)[:, None]
    # Pixels that nothing covers have the mean colour: averaging leaves no dark edge then.
    mean = np.append(light.mean(axis=0), 0.0)
    picture = np.tile(np.rint(255 * to_encoded(mean)), ((SIZE * _FINER) ** 2, 1)).astype(np.uint8)
    picture[seen.pixels, :3] = np.rint(255 * to_encoded(light))
    picture[seen.pixels, 3] = 255
    square = picture.reshape(SIZE * _FINER, SIZE * _FINER, 4)
    out = io.BytesIO()
    Image.fromarray(square).reduce(_FINER).save(out, "WEBP", quality=_QUALITY, method=2)
    return out.getvalue()


def _turned(vectors: Floats) -> Floats:
    """(n, 3) right, down and towards the viewer, of (n, 3) with y up."""
    x, y, z = vectors.T
    right = math.cos(_YAW) * x + math.sin(_YAW) * z
    ahead = math.cos(_YAW) * z - math.sin(_YAW) * x
    down = math.sin(_PITCH) * ahead - math.cos(_PITCH) * y
    return np.stack([right, down, math.cos(_PITCH) * ahead + math.sin(_PITCH) * y], axis=1)


def _seen(mesh: Mesh) -> Fragments | None:
    points = _turned(mesh.vertices)
    flat = points[mesh.used_vertices, :2]
    low, high = flat.min(axis=0), flat.max(axis=0)
    extent = float((high - low).max()) * _MARGIN
    if not 0 < extent < math.inf:
        return None
    size = SIZE * _FINER
    points[:, :2] = (points[:, :2] - (low + high) / 2) * (size / extent) + size / 2
    try:
        nearest, _ = both_ends(points, mesh.faces, size)
    except OverdrawError:
        return None
    return nearest


def _colours(seen: Fragments, paint: Paint | None) -> Floats:
    """Linear RGB (p, 3)."""
    plain = np.tile(_PLAIN, (len(seen.pixels), 1))
    if paint is None or not paint.is_at_hand:
        return plain
    [colours] = paint.colours([Spots(seen.faces, seen.weights)])
    return np.where(np.isnan(colours[:, :1]), plain, shown(colours))


def _brightness(mesh: Mesh, seen: Fragments) -> Floats:
    """(p,) of each pixel's face, whichever of its sides is seen."""
    normals = _turned(mesh.face_normals[seen.faces])
    normals *= np.where(normals[:, 2:] < 0, -1.0, 1.0)
    return np.asarray(_AMBIENT + _DIRECT * np.clip(normals @ np.array(_LAMP), 0, None))
