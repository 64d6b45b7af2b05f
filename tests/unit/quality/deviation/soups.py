"""Triangles in no order and of every kind, and distances found without this project."""

from __future__ import annotations

import numpy as np
import trimesh
from numpy.typing import NDArray

from meshcone.surface import Mesh

Floats = NDArray[np.float64]

KINDS = (
    "general",
    "needles",
    "points",
    "flat",
    "coincident",
    "squashed",
    "far from the origin",
    "tiny",
    "small and scattered",
)


def soup(seed: int, count: int, kind: str) -> Mesh:
    """Triangles that share no vertex."""
    random = np.random.default_rng(seed)
    vertices = random.normal(size=(3 * count, 3))
    if kind == "needles":
        vertices[2::3] = vertices[::3] + 1e-9 * random.normal(size=(count, 3))
    elif kind == "points":
        vertices[1::3] = vertices[2::3] = vertices[::3]
    elif kind == "flat":
        vertices[:, 2] = 0
    elif kind == "coincident":
        vertices = np.round(vertices * 2) / 2
    elif kind == "squashed":
        vertices *= [1, 1e-3, 1e-6]
    elif kind == "far from the origin":
        vertices = vertices * 1e-3 + 1e4
    elif kind == "tiny":
        vertices *= 1e-4
    elif kind == "small and scattered":
        vertices = np.repeat(random.normal(size=(count, 3)), 3, axis=0) + 0.05 * vertices
    return Mesh(vertices, np.arange(3 * count).reshape(count, 3))


def scattered(mesh: Mesh, count: int, seed: int = 0) -> Floats:
    """Points of a mesh: samples of every face, its corners and the middles of its edges."""
    random = np.random.default_rng(seed)
    faces = random.integers(len(mesh.faces), size=count)
    weights = random.dirichlet([1, 1, 1], size=count)
    samples = (weights[:, :, None] * mesh.corners[faces]).sum(axis=1)
    corners = mesh.corners
    middles = (corners + np.roll(corners, 1, axis=1)) / 2
    return np.concatenate([samples, corners.reshape(-1, 3), middles.reshape(-1, 3)])


def distances(points: Floats, reference: Mesh) -> Floats:
    """Distance of each point to the closest of all faces, tried one after the other."""
    centre = reference.vertices.mean(axis=0)
    scale = max(float(np.abs(each - centre).max()) for each in (points, reference.vertices))
    scale = scale or 1.0  # trimesh has tolerances in its unit
    moved = (points - centre) / scale
    found = np.full(len(points), np.inf)
    for corners in (reference.corners - centre) / scale:
        triangles = np.broadcast_to(corners, (len(points), 3, 3))
        closest = trimesh.triangles.closest_point(triangles, moved)
        found = np.minimum(found, np.linalg.norm(closest - moved, axis=1))
    return np.asarray(found * scale)
