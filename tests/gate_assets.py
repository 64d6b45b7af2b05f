"""A library of assets with references and gates, three of them bad."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests import shapes

PAIRS = 20
GATES = """
unit = "mm"

[gates]
"point_to_surface.max" = { max_model = 0.3 }
"normal_consistency" = { min_ratio_to_floor = 0.95 }
"validity.non_manifold_edges" = { max = 0 }

[classes.closed]
match = ["closed_*"]
gates."validity.watertight" = { equals = true }
"""
_HOLE, _SPIKE, _FIN = 3, 7, 12  # assets
_TIP = 30  # a vertex


def make_assets(directory: Path) -> None:
    """Write twenty balls, as many references, a manifest ``pairs.csv`` and ``gates.toml``.

    One ball has a hole, one a spike, one a fin: each exceeds one gate of its own.
    """
    vertices, faces = shapes.sphere(3)
    for name in ("props", "masters"):
        (directory / name).mkdir()
    rows = ["source,reference"]
    for number in range(PAIRS):
        name = f"closed_{number:02}.obj" if number < PAIRS // 2 else f"prop {number:02}.obj"
        master = vertices * (1 + number / 10)
        source, triangles = shapes.noisy(master, 0.005, seed=number), faces
        if number == _HOLE:
            triangles = faces[1:]
        if number == _SPIKE:
            source[_TIP] *= 1.2
        if number == _FIN:
            source, triangles = _with_fin(source, faces)
        (directory / "props" / name).write_bytes(shapes.obj(source, triangles))
        (directory / "masters" / name).write_bytes(shapes.obj(master, faces))
        rows.append(f"props/{name},masters/{name}")
    (directory / "pairs.csv").write_text("\n".join(rows) + "\n")
    (directory / "gates.toml").write_text(GATES)


def _with_fin(vertices: shapes.Vertices, faces: shapes.Faces) -> tuple[np.ndarray, np.ndarray]:
    """A third face at the first edge, hardly above the surface."""
    tip = vertices[faces[0, :2]].mean(axis=0) * 1.001
    fin = [faces[0, 0], faces[0, 1], len(vertices)]
    return np.vstack([vertices, tip]), np.vstack([faces, fin])
