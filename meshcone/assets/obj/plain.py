"""Writes what an OBJ file draws in words that every reader takes alike."""

from __future__ import annotations

import numpy as np

from meshcone.assets.obj.content import ObjTriangles
from meshcone.assets.obj.numbers import has_colors, read_colors, read_normals, read_texcoords
from meshcone.assets.obj.scan import ObjLines
from meshcone.surface.arrays import Floats


def plain_obj(
    lines: ObjLines, triangles: ObjTriangles, positions: Floats, library: str | None
) -> bytes:
    """Write triangles over the vertices, texture coordinates, normals and materials of a file.

    Args:
        lines: the file.
        triangles: all that it draws.
        positions: (r, 3) of its vertices.
        library: the one whose materials count.
    """
    written = [] if library is None else [f"mtllib {library}"]
    colors = read_colors(lines) if has_colors(lines) else np.empty((len(positions), 0))
    if not np.isfinite(colors).all():  # some vertices have none
        colors = colors[:, :0]
    written += _numbers("v", np.concatenate([positions, colors], axis=1))
    written += _numbers("vt", read_texcoords(lines))
    written += _numbers("vn", read_normals(lines))
    names = ["", *lines.names(lines.materials)]
    materials = np.searchsorted(lines.materials, triangles.statements).tolist()
    corners = zip(
        triangles.vertices.tolist(),
        triangles.texcoords.tolist(),
        triangles.normals.tolist(),
        materials,
        strict=True,
    )
    in_force = 0
    for v, vt, vn, material in corners:
        if material != in_force:
            written.append(f"usemtl {names[material]}")
            in_force = material
        written.append(f"f {' '.join(map(_corner, v, vt, vn))}")
    return ("\n".join(written) + "\n").encode()


def _numbers(keyword: str, rows: Floats) -> list[str]:
    # Rows keep their places; what is no number in one was never read.
    return [
        f"{keyword} {' '.join(map(repr, row))}" for row in np.nan_to_num(rows, nan=0.0).tolist()
    ]


def _corner(v: int, vt: int, vn: int) -> str:
    if vn >= 0:
        return f"{v + 1}/{vt + 1 if vt >= 0 else ''}/{vn + 1}"
    return f"{v + 1}/{vt + 1}" if vt >= 0 else f"{v + 1}"
