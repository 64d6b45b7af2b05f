"""The jug's two pieces: a body of revolution and a handle swept along a curve."""

from __future__ import annotations

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
    u = np.broadcast_to(np.arange(columns) / segments, (rows, columns)).copy()
    u[[0, -1], :-1] += 0.5 / segments
    v = np.broadcast_to(np.linspace(0, 1, rows)[:, None], (rows, columns))
    i, j = (index.ravel() for index in np.mgrid[0 : rows - 1, 0:segments])
    corner, right = i * columns + j, i * columns + j + 1
    above, diagonal = corner + columns, right + columns
    lower = np.stack([corner, right, diagonal], axis=1)[i > 0]
    upper = np.stack([corner, diagonal, above], axis=1)[i < rows - 2]
    last = np.stack([corner, right, above], axis=1)[i == rows - 2]
    lower = lower[:-segments] if len(last) else lower
    return _without_unused(
        Patch(
            positions=_around(profile, ring),
            normals=_around(normal, ring),
            uv=np.stack([u, v], axis=-1).reshape(-1, 2),
            triangles=np.concatenate([lower, upper, last]),
        )
    )
