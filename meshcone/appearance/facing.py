"""Closest points that face the same way as the points they are looked for from.

Where a body is thin, the closest point of another version of it is often on its far side, which
has another colour.
"""

from __future__ import annotations

import numpy as np

from meshcone.surface import ClosestPoints, Mesh, SurfaceTree
from meshcone.surface.arrays import Floats, Ints, row_dot

REACH = 0.1
"""How much farther away a point that faces the same way may be, as a share of the radius."""


class FacingSurface:
    """A mesh to be searched for points that face a given way."""

    def __init__(self, mesh: Mesh) -> None:
        """Prepare a mesh in the frame of the reference, where its radius is 1."""
        self._mesh = mesh
        self._sides: dict[tuple[int, bool], tuple[Ints, SurfaceTree | None]] = {}

    def closest(self, points: Floats, normals: Floats, found: ClosestPoints) -> ClosestPoints:
        """Replace closest points on faces that oppose the points' normals.

        Opposed points look again, among the faces that face the way of the coordinate axis
        closest to their normal. Where these are all over ``REACH`` farther away, as the far side
        of an open sheet is, what was found stays.

        Args:
            points: (k, 3) where the search began.
            normals: (k, 3) of the surface there.
            found: the closest points, whatever they face.
        """
        opposed = row_dot(normals, self._mesh.face_normals[found.faces]) < 0
        axes = np.argmax(np.abs(normals), axis=1)
        upwards = np.take_along_axis(normals, axes[:, None], axis=1)[:, 0] > 0
        distances, faces = found.distances.copy(), found.faces.copy()
        closest = found.points.copy()
        for axis in range(3):
            for up in (False, True):
                here = np.flatnonzero(opposed & (axes == axis) & (upwards == up))
                numbers, tree = self._side(axis, up) if len(here) else (here, None)
                if tree is None:
                    continue
                again = tree.closest(points[here])
                near = again.distances <= found.distances[here] + REACH
                chosen = here[near]
                distances[chosen] = again.distances[near]
                faces[chosen] = numbers[again.faces[near]]
                closest[chosen] = again.points[near]
        return ClosestPoints(distances, faces, closest)

    def _side(self, axis: int, up: bool) -> tuple[Ints, SurfaceTree | None]:
        """The faces that face one way along an axis, and a search among them if there are any."""
        if (axis, up) not in self._sides:
            along = self._mesh.face_normals[:, axis]
            numbers = np.flatnonzero(along > 0 if up else along < 0)
            tree = None
            if len(numbers):
                tree = SurfaceTree(Mesh(self._mesh.vertices, self._mesh.faces[numbers]))
            self._sides[axis, up] = numbers, tree
        return self._sides[axis, up]
