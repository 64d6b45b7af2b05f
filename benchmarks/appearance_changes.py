"""The changes that are made to assets whose colours are compared."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
import trimesh
from appearance_assets import Parts, Pixels
from numpy.typing import NDArray
from PIL import Image
from trimesh.visual import ColorVisuals, TextureVisuals

from meshcone.srgb import to_encoded

Harm = Literal["none", "depends", "always"]


@dataclass(frozen=True)
class Change:
    """A change to an asset; None where it has nothing to change."""

    name: str
    harm: Harm
    apply: Callable[[Parts], Parts | None]


def changes() -> Iterator[Change]:
    """The changes, those that do no harm first."""
    yield Change("none", "none", lambda parts: parts)
    yield Change("noise of .1 % of the radius", "none", noisy)
    yield Change("half the triangles", "none", coarser)
    yield Change("factor times .9", "none", on_factors(lambda factor: factor * (0.9, 0.9, 0.9, 1)))
    yield Change("JPEG, quality 90", "depends", on_images(lambda image: jpeg(image, 90)))
    yield Change("texture a quarter", "depends", on_images(lambda image: smaller(image, 4)))
    yield Change("JPEG, quality 20", "depends", on_images(lambda image: jpeg(image, 20)))
    yield Change("texture a sixteenth", "depends", on_images(lambda image: smaller(image, 16)))
    yield Change("sRGB read as linear", "always", on_images(as_linear))
    yield Change("red and blue swapped", "always", on_images(lambda image: image[..., ::-1]))
    yield Change("V flipped", "always", on_images(lambda image: image[::-1]))
    yield Change("replaced by magenta", "always", on_images(magenta))
    yield Change("texture lost", "always", without_texture)
    yield Change("coordinates scrambled", "always", scrambled)
    yield Change("materials rotated", "always", rotated)
    yield Change("vertex colours lost", "always", without_colours)


def textured(part: trimesh.Trimesh) -> bool:
    """Whether a part has a texture."""
    return (
        isinstance(part.visual, TextureVisuals)
        and getattr(part.visual.material, "baseColorTexture", None) is not None
    )


def on_images(change: Callable[[Pixels], Pixels]) -> Callable[[Parts], Parts | None]:
    """Change the textures of all parts."""

    def apply(parts: Parts) -> Parts | None:
        for part in filter(textured, parts):
            image = np.asarray(part.visual.material.baseColorTexture.convert("RGB"))
            made = Image.fromarray(np.ascontiguousarray(change(image)))
            part.visual.material = part.visual.material.copy()
            part.visual.material.baseColorTexture = made
        return parts if any(map(textured, parts)) else None

    return apply


def on_factors(
    change: Callable[[NDArray[np.float64]], NDArray[np.float64]],
) -> Callable[[Parts], Parts | None]:
    """Change the factors of all materials."""

    def apply(parts: Parts) -> Parts | None:
        found = [part for part in parts if isinstance(part.visual, TextureVisuals)]
        for part in found:
            factor = part.visual.material.baseColorFactor
            whole = np.array([255.0] * 4) if factor is None else np.asarray(factor, dtype=float)
            part.visual.material = part.visual.material.copy()
            part.visual.material.baseColorFactor = change(whole).round().astype(np.uint8)
        return parts if found else None

    return apply


def noisy(parts: Parts) -> Parts:
    """Move each vertex by a thousandth of the radius, those in one place together."""
    points = np.concatenate([part.vertices for part in parts])
    amount = 1e-3 * np.linalg.norm(np.ptp(points, axis=0)) / 2
    _, place = np.unique(points.round(6), axis=0, return_inverse=True)
    offsets = amount * np.random.default_rng(3).normal(size=(place.max() + 1, 3))
    moved = points + offsets[place.ravel()]
    for part, start in zip(parts, np.cumsum([0, *(len(p.vertices) for p in parts)]), strict=False):
        part.vertices = moved[start : start + len(part.vertices)]
    return parts


def coarser(parts: Parts) -> Parts | None:
    """The parts of our own with half as many triangles."""
    if not all("coarser" in part.metadata for part in parts):
        return None
    return [part.metadata["coarser"]() for part in parts]


def jpeg(image: Pixels, quality: int) -> Pixels:
    """What JPEG leaves of an image."""
    out = io.BytesIO()
    Image.fromarray(image).save(out, "JPEG", quality=quality)
    return np.asarray(Image.open(out))


def smaller(image: Pixels, times: int) -> Pixels:
    """The image with a texel for each block of them."""
    return np.asarray(Image.fromarray(image).reduce(times))


def as_linear(image: Pixels) -> Pixels:
    """The image brightened as by a tool that takes it for linear light."""
    return (255 * to_encoded(image / 255)).round().astype(np.uint8)


def magenta(_: Pixels) -> Pixels:
    """Two texels that nobody overlooks."""
    return np.tile(np.array([255, 0, 255], dtype=np.uint8), (2, 1, 1)).reshape(1, 2, 3)


def without_texture(parts: Parts) -> Parts | None:
    """Leave the factors alone."""
    found = list(filter(textured, parts))
    for part in found:
        part.visual.material = part.visual.material.copy()
        part.visual.material.baseColorTexture = None
    return parts if found else None


def scrambled(parts: Parts) -> Parts | None:
    """Give every vertex the coordinates of another."""
    found = list(filter(textured, parts))
    for part in found:
        order = np.random.default_rng(2).permutation(len(part.visual.uv))
        part.visual.uv = part.visual.uv[order]
    return parts if found else None


def rotated(parts: Parts) -> Parts | None:
    """Give every part the material of the next."""
    if len({id(part.visual) for part in parts}) < 2 or not all(
        isinstance(part.visual, TextureVisuals) for part in parts
    ):
        return None
    materials = [part.visual.material for part in parts]
    for part, material in zip(parts, materials[1:] + materials[:1], strict=True):
        part.visual.material = material
    return parts


def without_colours(parts: Parts) -> Parts | None:
    """Leave the shape alone."""
    if not any(isinstance(part.visual, ColorVisuals) for part in parts):
        return None
    return [trimesh.Trimesh(part.vertices, part.faces, process=False) for part in parts]
