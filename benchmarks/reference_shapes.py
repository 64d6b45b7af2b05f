"""The shapes benchmarks degrade and refine: made here, or read from a directory."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import trimesh

from meshcone.surface import Frame, Mesh
from meshcone.surface.arrays import Floats, Ints

_PLATE_THICKNESS = 0.04
_EVERY = 8  # of the shapes in a directory, for a small set


@dataclass(frozen=True)
class Shape:
    """A named reference in its own frame: inside the unit sphere, centred."""

    name: str
    load: Callable[[], Mesh]


def made_shapes(vertices: int) -> list[Shape]:
    """Five shapes of about ``vertices`` vertices each: round, sharp, thin and in two pieces."""
    return [
        Shape("sphere", lambda: framed(sphere(vertices))),
        Shape("torus", lambda: framed(bumpy_torus(vertices, bumps=0.0))),
        Shape("box", lambda: framed(box((1.0, 0.8, 0.6), vertices))),
        Shape("thin_plate", lambda: framed(box((1.0, 0.8, _PLATE_THICKNESS), vertices))),
        Shape("two_components", lambda: framed(two_components(vertices))),
    ]


def stored_shapes(directory: Path, *, small: bool) -> list[Shape]:
    """The files of ``directory/objects`` and ``directory/scans``, or every eighth of them."""
    paths = sorted((directory / "objects").glob("*")) + sorted((directory / "scans").glob("*"))
    chosen = paths[::_EVERY] if small else paths
    return [Shape(path.name.split(".")[0], partial(load, path)) for path in chosen]


def load(path: Path) -> Mesh:
    """Read a file as one welded mesh without degenerate faces, in its own frame."""
    read = trimesh.load(path, force="mesh", process=False)
    mesh = trimesh.Trimesh(read.vertices, read.faces, process=False)
    mesh.merge_vertices()
    mesh.update_faces(mesh.nondegenerate_faces())
    mesh.remove_unreferenced_vertices()
    return framed(Mesh(mesh.vertices, mesh.faces))


def framed(mesh: Mesh) -> Mesh:
    """The mesh moved and scaled into the unit sphere."""
    return Mesh(Frame.of(mesh).into(mesh.vertices), mesh.faces)


def sphere(vertices: int) -> Mesh:
    """An icosphere of the subdivision whose 10·4ᵏ + 2 vertices are nearest in proportion."""
    subdivisions = max(0, round(np.log(max(vertices - 2, 1) / 10) / np.log(4)))
    made = trimesh.creation.icosphere(subdivisions=subdivisions)
    return Mesh(made.vertices, made.faces)


def bumpy_torus(vertices: int, bumps: float = 0.06) -> Mesh:
    """A torus with twice as many rings as sides, its tube's radius varying along both.

    Args:
        vertices: about how many.
        bumps: amplitude of the variation; the tube's radius is 0.4, the torus's 1.
    """
    sides = max(3, round(np.sqrt(vertices / 2)))
    rings = max(3, round(vertices / sides))
    ring, side = np.meshgrid(np.arange(rings), np.arange(sides), indexing="ij")
    u, v = 2 * np.pi * ring.ravel() / rings, 2 * np.pi * side.ravel() / sides
    tube = 0.4 + bumps * np.sin(7 * u) * np.cos(4 * v)
    radius = 1 + tube * np.cos(v)
    points = np.stack([radius * np.cos(u), radius * np.sin(u), tube * np.sin(v)], axis=1)
    return Mesh(points, _grid_faces(ring.ravel(), side.ravel(), rings, sides))


def box(extents: Sequence[float], vertices: int) -> Mesh:
    """A box whose sides are grids of nearly square cells, its edges and corners sharp."""
    x, y, z = extents
    cell = np.sqrt(2 * (x * y + y * z + z * x) / max(vertices, 6))
    cells = [max(1, round(extent / cell)) for extent in extents]
    sides: list[tuple[Floats, Ints]] = []
    for axis in range(3):
        for at_end in (False, True):
            sides.append(_box_side(np.asarray(extents), cells, axis, at_end=at_end))
    merged = trimesh.util.concatenate([trimesh.Trimesh(*side, process=False) for side in sides])
    merged.merge_vertices()
    return Mesh(merged.vertices, merged.faces)


def two_components(vertices: int) -> Mesh:
    """A sphere and a box beside it that do not touch."""
    ball, block = sphere(vertices // 2), box((1.0, 1.0, 1.0), vertices // 2)
    return Mesh(
        np.concatenate([ball.vertices, block.vertices + np.array([1.4, -0.5, -0.5])]),
        np.concatenate([ball.faces, block.faces + len(ball.vertices)]),
    )


def _box_side(
    extents: Floats, cells: Sequence[int], axis: int, *, at_end: bool
) -> tuple[Floats, Ints]:
    first, second = (axis + 1) % 3, (axis + 2) % 3
    rows, columns = cells[first] + 1, cells[second] + 1
    i, j = (a.ravel() for a in np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij"))
    points = np.zeros((rows * columns, 3))
    points[:, axis] = extents[axis] * at_end
    points[:, first] = extents[first] * i / cells[first]
    points[:, second] = extents[second] * j / cells[second]
    inner = (i < rows - 1) & (j < columns - 1)
    faces = _grid_faces(i[inner], j[inner], rows, columns)
    return points, faces if at_end else faces[:, ::-1]


def _grid_faces(i: Ints, j: Ints, rows: int, columns: int) -> Ints:
    """Two triangles for each cell (i, j) of a grid; indices past its end wrap around."""
    below, right = (i + 1) % rows, (j + 1) % columns
    a, b = i * columns + j, below * columns + j
    c, d = below * columns + right, i * columns + right
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
