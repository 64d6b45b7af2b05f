"""The jug's two pieces: a body of revolution and a handle swept along a curve."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from service.demo.glb import Patch

Floats = NDArray[np.float64]


def smooth_curve(controls: Floats, count: int) -> Floats:
    """Draw a Catmull-Rom spline through control points, evenly spaced by length.

    Args:
        controls: (c, 2) points, at least two.
        count: number of points to return; the first and the last are the controls' own.

    Returns:
        (count, 2) points.
    """
    padded = np.concatenate(
        [[2 * controls[0] - controls[1]], controls, [2 * controls[-1] - controls[-2]]]
    )
    t = np.linspace(0, 1, 64, endpoint=False)[:, None]
    a, b, c, d = (padded[k : len(padded) - 3 + k, None] for k in range(4))
    dense = b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)))
    dense = np.concatenate([dense.reshape(-1, controls.shape[1]), controls[-1:]])
    lengths = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(dense, axis=0), axis=1))])
    even = np.linspace(0, lengths[-1], count)
    return np.stack([np.interp(even, lengths, column) for column in dense.T], axis=1)


def revolved(profile: Floats, segments: int) -> Patch:
    """Turn a profile around the z axis into a closed surface with a texture seam.

    Args:
        profile: (p, 2) radius and height; begins and ends on the axis, and runs so that the
            outside is on its right.
        segments: columns around the axis. The seam repeats the first column, and each pole
            is repeated for each segment, so that every triangle has its own texture.
    """
    angle = 2 * np.pi * np.arange(segments) / segments
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    ring = np.concatenate([ring, ring[:1]])  # the seam's two sides must be equal to the bit
    tangent = np.gradient(profile, axis=0)
    tangent[[0, -1], 1] = 0.0  # the surface is level where it meets the axis
    normal = np.stack([tangent[:, 1], -tangent[:, 0]], axis=1)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    rows, columns = len(profile), segments + 1
    u = np.tile(np.arange(columns) / segments, (rows, 1))
    u[0, :-1] += 0.5 / segments  # a pole's texture lies in the middle of its triangle
    u[-1, 1:] -= 0.5 / segments
    v = np.repeat(np.linspace(0, 1, rows), columns)
    i, j = (index.ravel() for index in np.mgrid[0 : rows - 1, 0:segments])
    triangles = _split_quads(i * columns + j, columns)
    at_pole = np.concatenate([i == 0, i == rows - 2])  # one of the two has no area there
    return _without_unused(
        Patch(
            positions=_around(profile, ring),
            normals=_around(normal, ring),
            uv=np.stack([u.ravel(), v], axis=1),
            triangles=triangles[~at_pole],
        )
    )


def swept(path: Floats, width: float, thickness: float, segments: int) -> Patch:
    """Sweep an ellipse along a curve in the plane y = 0 and close both ends with flat caps.

    Args:
        path: (p, 2) x and z of the curve; the outside of its bend is on its left.
        width: semi-axis along y.
        thickness: semi-axis in the curve's plane.
        segments: columns around the ellipse; the seam repeats the first.
    """
    angle = 2 * np.pi * np.arange(segments) / segments
    angle = np.concatenate([angle, angle[:1]])
    tangent = np.gradient(path, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    outward = np.stack([-tangent[:, 1], np.zeros(len(path)), tangent[:, 0]], axis=1)[:, None]
    sideways = np.array([0.0, 1.0, 0.0])
    cosine, sine = np.cos(angle)[None, :, None], np.sin(angle)[None, :, None]
    centre = np.stack([path[:, 0], np.zeros(len(path)), path[:, 1]], axis=1)
    rings = centre[:, None] + width * cosine * sideways + thickness * sine * outward
    normals = cosine / width * sideways + sine / thickness * outward
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    rows, columns = len(path), segments + 1
    i, j = (index.ravel() for index in np.mgrid[0 : rows - 1, 0:segments])
    u = np.tile(np.arange(columns) / segments, rows)
    tube = Patch(
        positions=rings.reshape(-1, 3),
        normals=normals.reshape(-1, 3),
        uv=np.stack([u, np.repeat(np.linspace(0, 1, rows), columns)], axis=1),
        triangles=_split_quads(i * columns + j, columns),
    )
    along = np.stack([tangent[:, 0], np.zeros(len(path)), tangent[:, 1]], axis=1)
    start = _cap(centre[0], rings[0, :-1], -along[0])
    end = _cap(centre[-1], rings[-1, :-1], along[-1])
    return _joined([tube, _flipped(start), end])


def _split_quads(corner: NDArray[np.int64], columns: int) -> NDArray[np.int64]:
    """(2q, 3) triangles of grid cells given by their first corner, in rows of ``columns``."""
    right, above = corner + 1, corner + columns
    lower = np.stack([corner, right, above + 1], axis=1)
    upper = np.stack([corner, above + 1, above], axis=1)
    return np.concatenate([lower, upper])


def _around(profile: Floats, ring: Floats) -> Floats:
    """Place each (radius, height) of a profile at each direction of a ring."""
    level = profile[:, None, :1] * ring[None]
    height = np.broadcast_to(profile[:, None, 1:], (*level.shape[:2], 1))
    return np.concatenate([level, height], axis=2).reshape(-1, 3)


def _cap(centre: Floats, ring: Floats, normal: Floats) -> Patch:
    """A fan of triangles with one flat normal, its texture a disc."""
    count = len(ring)
    angle = 2 * np.pi * np.arange(count) / count
    rim = np.arange(count)
    return Patch(
        positions=np.concatenate([[centre], ring]),
        normals=np.tile(normal, (count + 1, 1)),
        uv=0.5 + np.concatenate([[[0, 0]], np.stack([np.cos(angle), np.sin(angle)], axis=1) / 2]),
        triangles=np.stack([np.zeros(count, np.int64), 1 + rim, 1 + (rim + 1) % count], axis=1),
    )


def _flipped(patch: Patch) -> Patch:
    return replace(patch, triangles=patch.triangles[:, ::-1])


def _joined(patches: Sequence[Patch]) -> Patch:
    offsets = np.cumsum([0, *(len(patch.positions) for patch in patches)])
    shifted = [p.triangles + offset for p, offset in zip(patches, offsets[:-1], strict=True)]
    return Patch(
        positions=np.concatenate([patch.positions for patch in patches]),
        normals=np.concatenate([patch.normals for patch in patches]),
        uv=np.concatenate([patch.uv for patch in patches]),
        triangles=np.concatenate(shifted),
    )


def _without_unused(patch: Patch) -> Patch:
    used, triangles = np.unique(patch.triangles, return_inverse=True)
    return Patch(
        positions=patch.positions[used],
        normals=patch.normals[used],
        uv=patch.uv[used],
        triangles=triangles.reshape(-1, 3),
    )
