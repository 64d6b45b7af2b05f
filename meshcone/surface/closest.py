"""Exact closest points on a triangle mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from meshcone.surface.arrays import Floats, Ints
from meshcone.surface.mesh import Mesh


@dataclass(frozen=True)
class ClosestPoints:
    """The answer to a closest-point query, one row per query point.

    Attributes:
        distances: (k,) Euclidean distances.
        faces: (k,) index of the closest face.
        points: (k, 3) the closest points themselves.
    """

    distances: Floats
    faces: Ints
    points: Floats


class SurfaceTree:
    """A mesh prepared for closest-point queries."""

    def __init__(self, mesh: Mesh) -> None:
        """Build the mesh's tree, O(m log m), or refit that of a mesh it was moved from, O(m)."""
        self.mesh = mesh
        self._tree = mesh.tree

    def closest(self, points: Floats) -> ClosestPoints:
        """Find the closest point of the mesh to each of (k, 3) points.

        Of equally close faces it is the one of the lowest index. A point that is not finite is
        infinitely far and has face 0. Points that are neighbours are found fastest one after
        the other.
        """
        squared, faces, closest = self._tree.search(np.require(points, np.float64, ["C", "W"]))
        return ClosestPoints(np.sqrt(squared), faces, closest)


def barycentric_weights(points: Floats, mesh: Mesh, faces: Ints) -> Floats:
    """Barycentric coordinates (k, 3) of points that lie on the given faces of a mesh.

    Coordinates are clipped to the triangle and sum to one; a face without area gives
    its corners equal weight.
    """
    # Numba takes a while to import, and not all who read meshes need it.
    from meshcone.surface.face_points import find_shares

    shares = np.empty((len(points), 3))
    points = np.require(points, np.float64, ["C", "W"])
    faces = np.require(faces, np.int64, ["C", "W"])
    find_shares(points, mesh.vertices, mesh.faces, faces, shares)
    return shares
