"""Faces that a refinement turned against the reference.

A face *agrees* with the reference if any reference triangle within 1e-6 + 1.01 times the
closest distance of the face's centroid faces the same way, so that a reference whose sheets
are double-sided agrees with faces of either side. A face is *flipped* if it agreed before
and no triangle there agrees after; faces without area face no way and are not counted.
Where most faces of the input oppose the closest triangle, the input is inside out as a
whole and every normal is taken reversed.
"""

from __future__ import annotations

import numpy as np
import trimesh
from scipy.spatial import KDTree

from meshcone.surface import Mesh, SurfaceTree
from meshcone.surface.arrays import Floats, Ints, row_dot

_REACH_FLOOR, _REACH_FACTOR = 1e-6, 1.01
_AT_ONCE = 256  # centroids whose candidate triangles are listed together


class FacingReference:
    """A reference prepared for asking which of its triangles face the same way as a face."""

    def __init__(self, tree: SurfaceTree) -> None:
        self._tree = tree
        corners = tree.mesh.corners
        self._centroids = corners.mean(axis=1)
        extents = np.linalg.norm(corners - self._centroids[:, None], axis=2).max(axis=1)
        # Triangles of similar extent share a tree, so that one long triangle does not
        # make every query around a short one wide.
        scale = np.floor(np.log2(np.maximum(extents, 1e-12)))
        self._groups = [
            (members, KDTree(self._centroids[members]), float(extents[members].max()))
            for members in (np.flatnonzero(scale == level) for level in np.unique(scale))
        ]

    def orientation(self, mesh: Mesh) -> float:
        """1, or −1 where most faces of the mesh oppose the closest triangle."""
        return 1.0 if np.mean(np.sign(self._closest_facing(mesh)[0])) >= 0 else -1.0

    def opposed(self, mesh: Mesh, orientation: float, candidates: Ints) -> Ints:
        """The candidate faces with area that no reference triangle in reach agrees with."""
        part = Mesh(mesh.vertices, mesh.faces[candidates])
        facing, distances = self._closest_facing(part)
        doubtful = np.flatnonzero((orientation * facing <= 0) & (part.face_areas > 0))
        if not len(doubtful):
            return doubtful
        found = [
            chunk[~self._any_agrees(part, chunk, orientation, distances[chunk])]
            for chunk in np.array_split(doubtful, len(doubtful) // _AT_ONCE + 1)
        ]
        return np.asarray(candidates[np.concatenate(found)])

    def _closest_facing(self, mesh: Mesh) -> tuple[Floats, Floats]:
        closest = self._tree.closest(mesh.corners.mean(axis=1))
        normals = self._tree.mesh.face_normals[closest.faces]
        return row_dot(mesh.face_normals, normals), closest.distances

    def _any_agrees(
        self, mesh: Mesh, faces: Ints, orientation: float, distances: Floats
    ) -> np.ndarray:
        points = mesh.corners[faces].mean(axis=1)
        normals = orientation * mesh.face_normals[faces]
        reach = _REACH_FLOOR + _REACH_FACTOR * distances
        agrees = np.zeros(len(faces), dtype=bool)
        for members, tree, extent in self._groups:
            near = tree.query_ball_point(points, reach + extent)
            rows = np.repeat(np.arange(len(faces)), [len(found) for found in near])
            triangles = members[np.concatenate(near).astype(np.int64)]
            same_way = row_dot(normals[rows], self._tree.mesh.face_normals[triangles]) > 0
            rows, triangles = rows[same_way & ~agrees[rows]], triangles[same_way & ~agrees[rows]]
            corners = self._tree.mesh.corners[triangles]
            on_triangle = trimesh.triangles.closest_point(corners, points[rows])
            within = np.linalg.norm(on_triangle - points[rows], axis=1) <= reach[rows]
            agrees[rows[within]] = True
        return agrees


def flipped_faces(before: Mesh, after: Mesh, reference: FacingReference) -> int:
    """Count the faces that agreed with the reference before and are opposed after.

    Args:
        before: the input.
        after: the same faces over other positions.
        reference: what both are compared with.
    """
    orientation = reference.orientation(before)
    opposed_after = reference.opposed(after, orientation, np.arange(len(after.faces)))
    if not len(opposed_after):
        return 0
    flat = before.face_areas[opposed_after] == 0
    opposed_before = reference.opposed(before, orientation, opposed_after)
    return len(opposed_after) - len(opposed_before) - int(np.count_nonzero(flat))
