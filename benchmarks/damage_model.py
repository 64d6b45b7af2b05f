"""An asset that has everything, as data that can be damaged.

A pot with a lid and a flag: two materials, two textures, a skin, a morph target, an animation, a
camera, a light, vertex colours, extra data. No two sides of it are alike.
"""

from __future__ import annotations

import io
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

_TEXELS, _SPOT = 512, 80
_ROUND, _HIGH = 32, 16  # segments of the pot


@dataclass
class Part:
    """A mesh with one material, at a node of its own."""

    name: str
    material: int
    positions: Floats
    normals: Floats | None
    uvs: Floats | None
    faces: Integers
    colors: Floats | None = None
    joints: Integers | None = None
    weights: Floats | None = None
    target: Floats | None = None
    place: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    parent: str | None = "stand"


@dataclass
class Surface:
    """A material; images are numbers."""

    name: str
    color: list[float]
    base: int | None = None
    normal: int | None = None
    roughness: float = 0.5
    alpha: str = "OPAQUE"
    double_sided: bool = False
    ior: float | None = None


@dataclass
class Model:
    """The whole asset."""

    parts: list[Part]
    surfaces: list[Surface]
    images: list[bytes | None]
    joints: list[str]
    bound: bool = True
    animation: str | None = "wave"
    times: Floats = field(default_factory=lambda: np.array([0, 0.5, 1.25]))
    turns: Floats | None = None
    lifts: Floats | None = field(default_factory=lambda: np.array([0, 1, 0.0]))
    camera: bool = True
    light: bool = True
    extras: dict[str, Any] = field(default_factory=lambda: {"sku": "P-17"})
    root: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    library: bool = True


def whole_model() -> Model:
    """The asset, undamaged."""
    half = np.sqrt(0.5)
    return Model(
        parts=[_pot(), _lid(), _flag()],
        surfaces=[
            Surface("glaze", [1.0, 1.0, 1.0, 1.0], base=0, normal=1, roughness=0.3),
            Surface("brass", [0.8, 0.6, 0.2, 1.0], roughness=0.4, ior=1.6),
        ],
        images=[_painting(), _bumps()],
        joints=["pole", "tip"],
        turns=np.array([[0, 0, 0, 1], [0, half, 0, half], [0, 0, 0, 1]]),
    )


def _pot() -> Part:
    around, up = np.meshgrid(np.linspace(0, 1, _ROUND + 1), np.linspace(0, 1, _HIGH + 1))
    angle, height = 2 * np.pi * around.ravel(), up.ravel()
    radius = 0.6 + 0.3 * np.sin(2.5 * height + 0.3) + 0.04 * np.cos(3 * angle) * height
    points = np.column_stack([radius * np.cos(angle), 1.6 * height, radius * np.sin(angle)])
    points[:: _ROUND + 1] = points[_ROUND :: _ROUND + 1]  # the seam is one line, to the last bit
    faces = _grid(_ROUND, _HIGH)[:, ::-1]
    uvs = np.column_stack([0.48 - 0.46 * around.ravel(), 0.02 + 0.96 * (1 - height)])
    return Part("pot", 0, points, _normals(points, faces), uvs, faces)


def _lid() -> Part:
    around, out = np.meshgrid(np.linspace(0, 1, 25), np.linspace(0.02, 1, 7))
    angle, radius = 2 * np.pi * around.ravel(), out.ravel()
    points = np.column_stack(
        [0.7 * radius * np.cos(angle), 0.25 * (1 - radius**2), 0.7 * radius * np.sin(angle)]
    )
    points[::25] = points[24::25]
    faces = _grid(24, 6)
    outward = np.column_stack([np.cos(angle), np.sin(angle)])
    uvs = 0.5 + 0.45 * radius[:, None] * outward
    colors = np.column_stack([np.full(len(points), 0.9), radius, 1 - radius, np.ones(len(points))])
    target = np.column_stack([np.zeros(len(points)), 0.2 * (1 - radius), np.zeros(len(points))])
    return Part(
        "lid",
        1,
        points,
        _normals(points, faces),
        uvs,
        faces,
        colors=colors,
        target=target,
        place=[0.0, 1.7, 0.0],
    )


def _flag() -> Part:
    across, up = np.meshgrid(np.linspace(0, 1, 9), np.linspace(0, 1, 7))
    points = np.column_stack(
        [1.1 + 0.8 * across.ravel(), 0.5 + 0.6 * up.ravel(), 0.05 * np.sin(6 * across.ravel())]
    )
    faces = _grid(8, 6)
    uvs = np.column_stack([0.52 + 0.46 * across.ravel(), 0.02 + 0.96 * (1 - up.ravel())])
    far = across.ravel()
    zero = np.zeros_like(far)
    return Part(
        "flag",
        0,
        points,
        _normals(points, faces),
        uvs,
        faces,
        joints=np.tile([0, 1, 0, 0], (len(points), 1)),
        weights=np.column_stack([1 - far, far, zero, zero]),
        parent=None,
    )


def _grid(columns: int, rows: int) -> Integers:
    row, column = (each.ravel() for each in np.mgrid[:rows, :columns])
    first = row * (columns + 1) + column
    second = first + columns + 1
    lower = np.column_stack([first, first + 1, second + 1])
    return np.vstack([lower, np.column_stack([first, second + 1, second])])


def _normals(points: Floats, faces: Integers) -> Floats:
    """Area-weighted, and alike at both sides of a seam."""
    corners = points[faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    _, same = np.unique(points, axis=0, return_inverse=True)
    total = np.zeros((same.max() + 1, 3))
    for corner in range(3):
        np.add.at(total, same[faces[:, corner]], across)
    found = total[same]
    return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True))


def _painting() -> bytes:
    """Spots and stripes of many colours."""
    y, x = np.mgrid[:_TEXELS, :_TEXELS]
    red = 90 + 60 * np.sin(x / 34) + 30 * ((x // _SPOT + y // _SPOT) % 2)
    green = 110 + 70 * np.sin(y / 46 + x / 120)
    blue = 70 + 50 * ((y // _SPOT) % 2) + x / 12
    return png(np.clip(np.dstack([red, green, blue]), 45, 235).astype(np.uint8))


def _bumps() -> bytes:
    y, x = np.mgrid[:_TEXELS, :_TEXELS]
    tilt = np.dstack([0.2 * np.sin(x / 40), 0.2 * np.cos(y / 56), np.ones_like(x, dtype=float)])
    tilt /= np.linalg.norm(tilt, axis=2, keepdims=True)
    return png(np.rint(127.5 * (tilt + 1)).astype(np.uint8))


def png(pixels: NDArray[np.uint8]) -> bytes:
    """An image file."""
    out = io.BytesIO()
    Image.fromarray(pixels).save(out, "PNG")
    return out.getvalue()


def pixels_of(data: bytes | None) -> NDArray[np.uint8]:
    """What an image file shows."""
    return np.asarray(Image.open(io.BytesIO(data or b"")).convert("RGB"))
