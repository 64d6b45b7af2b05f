"""Meshes the tests make for themselves."""

from __future__ import annotations

import numpy as np
import trimesh

from meshcone.surface import Mesh


def sphere(subdivisions: int = 3) -> Mesh:
    """A unit icosphere: 162, 642, 2562 vertices for 2, 3, 4 subdivisions."""
    made = trimesh.creation.icosphere(subdivisions=subdivisions)
    return Mesh(made.vertices, made.faces)


def torus(rings: int = 48, sides: int = 24, tube: float = 0.35) -> Mesh:
    """A torus of radius 1 around the z axis."""
    u, v = np.meshgrid(np.arange(rings), np.arange(sides), indexing="ij")
    around, along = 2 * np.pi * u.ravel() / rings, 2 * np.pi * v.ravel() / sides
    radius = 1 + tube * np.cos(along)
    vertices = np.stack(
        [radius * np.cos(around), radius * np.sin(around), tube * np.sin(along)], axis=1
    )
    return Mesh(vertices, _grid_faces(rings, sides, wrap_rows=True, wrap_columns=True))


def cylinder(sides: int, rings: int, radius: float, height: float) -> Mesh:
    """An open cylinder around the z axis, centred."""
    u, v = np.meshgrid(np.arange(sides), np.arange(rings), indexing="ij")
    around, up = 2 * np.pi * u.ravel() / sides, v.ravel() / (rings - 1) - 0.5
    vertices = np.stack([radius * np.cos(around), radius * np.sin(around), height * up], axis=1)
    return Mesh(vertices, _grid_faces(sides, rings, wrap_rows=True, wrap_columns=False))


def sheet(rows: int, columns: int) -> Mesh:
    """A flat open grid in the xy plane, unit spacing; V = rows·columns."""
    x, y = np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij")
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(rows * columns)], axis=1)
    return Mesh(vertices, _grid_faces(rows, columns, wrap_rows=False, wrap_columns=False))


def joined_halves(left: int, right: int, gap: float = 0.0) -> Mesh:
    """Two unit squares side by side, of so many cells along each side.

    Vertices at one place are one; where the numbers differ, the others lie on the edges across.
    """
    one, other = (sheet(cells + 1, cells + 1) for cells in (left, right))
    shifted = other.vertices / right + np.array([1.0 + gap, 0, 0])
    places, index = np.unique(
        np.concatenate([one.vertices / left, shifted]), axis=0, return_inverse=True
    )
    faces = np.concatenate([one.faces, other.faces + len(one.vertices)])
    return Mesh(places, index.ravel()[faces])


def noisy(mesh: Mesh, sigma: float, seed: int = 0) -> Mesh:
    """The mesh with Gaussian noise on every coordinate."""
    noise = np.random.default_rng(seed).normal(size=mesh.vertices.shape) * sigma
    return mesh.moved_to(mesh.vertices + noise)


def closed_by_thin_faces(mesh: Mesh, *, turned: bool = False) -> Mesh:
    """The same surface with bent edges halved on one side, and faces without area in the gaps.

    Args:
        mesh: closed; a face is halved at one of its edges at most.
        turned: whether the faces without area run the other way round.
    """
    vertices, faces, thin = list(mesh.vertices), [list(face) for face in mesh.faces], []
    owner = {
        (int(face[k]), int(face[k - 2])): number
        for number, face in enumerate(mesh.faces)
        for k in range(3)
    }
    halved = set()
    for (a, b), number in owner.items():
        bent = mesh.face_normals[number] @ mesh.face_normals[owner[b, a]] < 0.9
        if a > b or not bent or number in halved:
            continue
        halved.add(number)
        [apex] = set(map(int, mesh.faces[number])) - {a, b}
        middle = len(vertices)
        vertices.append((vertices[a] + vertices[b]) / 2)
        faces[number] = [a, middle, apex]
        faces.append([middle, b, apex])
        thin.append([middle, b, a] if turned else [middle, a, b])
    return Mesh(np.array(vertices), np.array(faces + thin))


def together(*meshes: Mesh) -> Mesh:
    """Return one mesh of several, whose vertices and faces follow one another."""
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.faces + start for mesh, start in zip(meshes, starts, strict=False)]),
    )


def _grid_faces(rows: int, columns: int, *, wrap_rows: bool, wrap_columns: bool) -> np.ndarray:
    i = np.arange(rows if wrap_rows else rows - 1)
    j = np.arange(columns if wrap_columns else columns - 1)
    i, j = (a.ravel() for a in np.meshgrid(i, j, indexing="ij"))

    def at(row: np.ndarray, column: np.ndarray) -> np.ndarray:
        return (row % rows) * columns + column % columns

    a, b, c, d = at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
