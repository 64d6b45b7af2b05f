"""The pair the demonstration works on: a jug, and the same file with noise on it."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from meshcone.assets import read_asset
from service.demo.glb import Material, Patch, Placement, write_glb
from service.demo.shapes import revolved, smooth_curve, swept

NOISE = 0.02  # standard deviation on each coordinate, relative to the reference's radius

GLAZE = Material("glaze", (0.05, 0.25, 0.33), metallic=0.0, roughness=0.25)
COPPER = Material("copper", (0.52, 0.19, 0.08), metallic=1.0, roughness=0.35)

# Radius and height along the jug's section: under the foot, up the outside, over the rim
# and down the inside, from axis to axis.
_BODY = (
    (0.0, 0.07), (0.28, 0.07), (0.36, 0.04), (0.41, 0.0), (0.47, 0.0), (0.49, 0.06),
    (0.50, 0.12), (0.66, 0.36), (0.77, 0.70), (0.72, 1.02), (0.55, 1.30), (0.43, 1.52),
    (0.42, 1.68), (0.48, 1.86), (0.56, 1.98), (0.56, 2.02), (0.51, 2.03), (0.41, 1.88),
    (0.33, 1.70), (0.33, 1.50), (0.45, 1.26), (0.63, 0.98), (0.68, 0.70), (0.58, 0.40),
    (0.38, 0.22), (0.18, 0.16), (0.0, 0.15),
)  # fmt: skip
_BODY_ROWS, _BODY_COLUMNS = 66, 66

# x and z along the handle; both ends lie level inside the body's wall.
_HANDLE = (
    (0.735, 0.72), (0.83, 0.72), (1.05, 0.79), (1.20, 1.05), (1.22, 1.36), (1.06, 1.62),
    (0.80, 1.71), (0.55, 1.68), (0.385, 1.68),
)  # fmt: skip
_HANDLE_WIDTH, _HANDLE_THICKNESS = 0.105, 0.055
_HANDLE_ROWS, _HANDLE_COLUMNS = 40, 18

# Modelled with z up and two units high; glTF has y up and is in metres. The jug is turned
# a little and stands away from the origin, as a piece of a scene does.
_YAW = math.radians(35)
_TILT = math.radians(-90)
_PLACEMENT = Placement(
    translation=(0.4, 0.75, -0.2),
    rotation=(
        math.cos(_YAW / 2) * math.sin(_TILT / 2),
        math.sin(_YAW / 2) * math.cos(_TILT / 2),
        -math.sin(_YAW / 2) * math.sin(_TILT / 2),
        math.cos(_YAW / 2) * math.cos(_TILT / 2),
    ),
    scale=0.12,
)


def reference_glb() -> bytes:
    """The jug: one mesh of two closed pieces, about 5,000 vertices, in two materials."""
    return write_glb("jug", _parts(), _PLACEMENT)


def degraded(reference: bytes, seed: int = 0) -> bytes:
    """The same file with Gaussian noise on its welded vertices, so that no seam opens.

    Args:
        reference: a GLB file.
        seed: of the noise.

    Raises:
        InputError, LimitError: the file cannot be read.
    """
    asset = read_asset("reference.glb", reference)
    low, high = asset.vertices.min(axis=0), asset.vertices.max(axis=0)
    radius = np.linalg.norm(asset.vertices - (low + high) / 2, axis=1).max()
    noise = np.random.default_rng(seed).normal(size=asset.vertices.shape)
    return asset.patched(asset.vertices + NOISE * radius * noise)


def face_colours() -> NDArray[np.float64]:
    """(m, 3) colours of the jug's triangles, linear RGB, in the order of its file."""
    return np.concatenate(
        [np.tile(material.colour, (len(patch.triangles), 1)) for patch, material in _parts()]
    )


def _parts() -> list[tuple[Patch, Material]]:
    body = revolved(smooth_curve(np.array(_BODY), _BODY_ROWS), _BODY_COLUMNS)
    handle = swept(
        smooth_curve(np.array(_HANDLE), _HANDLE_ROWS),
        _HANDLE_WIDTH,
        _HANDLE_THICKNESS,
        _HANDLE_COLUMNS,
    )
    return [(body, GLAZE), (handle, COPPER)]
