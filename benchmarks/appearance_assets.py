"""The assets whose colours are compared: what a globe, a ring, blocks and a scan look like."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import trimesh
from numpy.typing import NDArray
from PIL import Image
from trimesh.visual import ColorVisuals, TextureVisuals
from trimesh.visual.material import PBRMaterial

from meshcone.srgb import to_linear

_SIZE = 1024  # of a texture

Parts = list[trimesh.Trimesh]
Pixels = NDArray[np.uint8]
Shape = Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]


def made_assets() -> Iterator[tuple[str, Parts]]:
    """The assets of the benchmark's own."""
    yield "globe", [grid(globe, photograph())]
    yield "label", [grid(ring, label())]
    yield "blocks", list(blocks())
    yield "scan", [scan()]


def grid(shape: Shape, image: Pixels, across: int = 96, along: int = 48) -> trimesh.Trimesh:
    """A surface over the unit square, which the image fills."""
    u, v = np.meshgrid(np.linspace(0, 1, across + 1), np.linspace(0, 1, along + 1))
    number = np.arange(u.size).reshape(u.shape)
    a, b = number[:-1, :-1].ravel(), number[:-1, 1:].ravel()
    c, d = number[1:, :-1].ravel(), number[1:, 1:].ravel()
    faces = np.concatenate([np.stack([a, d, c], axis=1), np.stack([a, b, d], axis=1)])
    material = PBRMaterial(
        baseColorTexture=Image.fromarray(image), baseColorFactor=[255] * 4, metallicFactor=0.0
    )
    made = trimesh.Trimesh(
        shape(u.ravel(), v.ravel()),
        faces,
        visual=TextureVisuals(uv=np.stack([u.ravel(), v.ravel()], axis=1), material=material),
        process=False,
    )
    made.metadata["coarser"] = lambda: grid(shape, image, across * 7 // 10, along * 7 // 10)
    return made


def globe(u: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
    """A sphere."""
    around, down = 2 * np.pi * u, np.pi * (v - 0.5)
    return np.stack(
        [np.cos(down) * np.cos(around), np.cos(down) * np.sin(around), np.sin(down)], axis=1
    )


def ring(u: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
    """A torus."""
    around, over = 2 * np.pi * u, 2 * np.pi * v
    wide = 1 + 0.4 * np.cos(over)
    return np.stack([wide * np.cos(around), wide * np.sin(around), 0.4 * np.sin(over)], axis=1)


def photograph() -> Pixels:
    """Patches of colour with finer ones on them, fainter by a fifth from octave to octave."""
    rng = np.random.default_rng(6)
    summed = np.zeros((_SIZE, _SIZE, 3))
    for octave in range(2, 9):
        grey = rng.normal(size=(2**octave, 2**octave, 1))
        coarse = (grey + 0.5 * rng.normal(size=(2**octave, 2**octave, 3))).astype(np.float32)
        for channel in range(3):
            patch = Image.fromarray(coarse[..., channel])
            fine = patch.resize((_SIZE, _SIZE), Image.Resampling.BICUBIC)
            summed[..., channel] += 0.8**octave * np.asarray(fine)
    low, high = np.percentile(summed, (1, 99))
    return (255 * ((summed - low) / (high - low)).clip(0, 1)).astype(np.uint8)


def label() -> Pixels:
    """Bars, discs and lines with sharp edges, as printed things have."""
    y, x = np.mgrid[0:_SIZE, 0:_SIZE] / _SIZE
    image = np.full((_SIZE, _SIZE, 3), (235, 225, 200), dtype=np.uint8)
    image[(x % 0.5) < 0.12] = (170, 30, 40)
    image[np.hypot(x - 0.6, y - 0.4) < 0.2] = (30, 60, 140)
    image[(np.abs(x - 0.3) < 0.1) & (y % 0.1 < 0.04) & (y > 0.5)] = (20, 20, 20)
    image[np.abs(y - 0.8) < 0.02] = (240, 190, 30)
    return image


def blocks() -> Iterator[trimesh.Trimesh]:
    """Boxes on top of each other, each in one colour."""
    for number, color in enumerate([(200, 40, 40), (40, 160, 60), (50, 70, 200), (230, 200, 60)]):
        box = trimesh.creation.box(extents=(1 - 0.15 * number, 1 - 0.15 * number, 0.5))
        box = box.subdivide().subdivide()
        box.apply_translation((0, 0, 0.55 * number))
        factor = [*(255 * to_linear(np.array(color) / 255)).round().astype(int), 255]
        box.visual = TextureVisuals(
            uv=box.vertices[:, :2], material=PBRMaterial(baseColorFactor=factor, metallicFactor=0.0)
        )
        yield box


def scan() -> trimesh.Trimesh:
    """A bumpy ball with a colour at each of its vertices."""
    ball = trimesh.creation.icosphere(subdivisions=5)
    waves = np.sin(5 * ball.vertices) + np.sin(9 * ball.vertices[:, [1, 2, 0]])
    colours = (127 + 60 * waves).clip(0, 255).astype(np.uint8)
    ball.vertices *= 1 + 0.03 * waves.mean(axis=1, keepdims=True)
    ball.visual = ColorVisuals(
        ball, vertex_colors=np.column_stack([colours, np.full(len(colours), 255)])
    )
    return ball
