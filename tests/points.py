"""Clouds of points that tests make."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]


def on_sphere(count: int, radius: float = 1.0) -> Points:
    """Points on a sphere around the origin, evenly along a spiral (Fibonacci's)."""
    height = 1 - (2 * np.arange(count) + 1) / count
    angle = np.pi * (3 - np.sqrt(5)) * np.arange(count)
    around = np.sqrt(1 - height**2)
    unit = np.stack([around * np.cos(angle), around * np.sin(angle), height], axis=1)
    return np.asarray(radius * unit)


def xyz(points: Points, beside: Points | None = None) -> bytes:
    """A line of numbers for each point, with three more if there are some beside."""
    rows = points if beside is None else np.concatenate([points, beside], axis=1)
    return "".join(f"{' '.join(map(repr, row))}\n" for row in rows.tolist()).encode()


def ply_points(points: Points, normals: Points | None = None) -> bytes:
    """A binary PLY without faces."""
    names = ["x", "y", "z"] + (["nx", "ny", "nz"] if normals is not None else [])
    rows = points if normals is None else np.concatenate([points, normals], axis=1)
    properties = "".join(f"property double {name}\n" for name in names)
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(rows)}\n{properties}"
    return (head + "end_header\n").encode() + rows.astype("<f8").tobytes()
