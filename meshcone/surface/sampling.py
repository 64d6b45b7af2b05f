"""Seeded samples of a surface, uniform by area."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from meshcone.surface.arrays import Floats, Ints
from meshcone.surface.mesh import Mesh
from meshcone.surface.ordering import spatial_order
from meshcone.surface.sobol import sobol_points

SamplingMethod = Literal["sobol", "random"]


@dataclass(frozen=True)
class SurfaceSamples:
    """Points on a surface.

    Attributes:
        points: (k, 3) positions.
        normals: (k, 3) unit normals of the faces they lie on.
        faces: (k,) those faces' indices.
    """

    points: Floats
    normals: Floats
    faces: Ints

    def in_space(self) -> SurfaceSamples:
        """Return the samples in an order in which neighbours in space follow each other.

        In the order in which they are drawn each is far from the one before: a search for
        closest points then takes three times as long on a mesh of 80,000 faces.
        """
        order = spatial_order(self.points)
        points, normals = self.points.take(order, axis=0), self.normals.take(order, axis=0)
        return SurfaceSamples(points, normals, self.faces.take(order))


def sample_surface(
    mesh: Mesh,
    count: int,
    seed: int,
    method: SamplingMethod = "sobol",
    along: Floats | None = None,
) -> SurfaceSamples:
    """Draw ``count`` points distributed uniformly over the mesh's area.

    Args:
        mesh: a mesh of positive total area.
        count: number of points.
        seed: the same seed gives the same points on the same mesh.
        method: ``sobol`` draws from a scrambled Sobol sequence, whose means over the
            surface vary less between seeds; ``random`` draws independently, as the
            literature's metrics do.
        along: (count,) ascending shares of the area, in the order of the faces, at which the
            points are to lie; by default they are drawn too.
    """
    uniform = _unit_cube(count, seed, method)
    if along is not None:
        uniform = np.column_stack([along, uniform[:, 1:]])
    cumulative = np.cumsum(mesh.face_areas)
    faces = np.searchsorted(cumulative, uniform[:, 0] * cumulative[-1], side="right")
    faces = np.minimum(faces, len(mesh.faces) - 1)
    root = np.sqrt(uniform[:, 1])
    weights = np.stack([1 - root, root * (1 - uniform[:, 2]), root * uniform[:, 2]], axis=1)
    # Numba takes a while to import, and not all who read meshes need it.
    from meshcone.surface.face_points import place

    points = np.empty((count, 3))
    place(weights, mesh.vertices, mesh.faces, faces, points)
    return SurfaceSamples(points, mesh.face_normals.take(faces, axis=0), faces)


def _unit_cube(count: int, seed: int, method: SamplingMethod) -> Floats:
    if method == "random":
        return np.random.default_rng(seed).random((count, 3))
    # A Sobol sequence is balanced over powers of two; its prefix keeps the low discrepancy.
    return sobol_points(max(count - 1, 1).bit_length(), seed)[:count]
