"""How far a mesh is from another where it is farthest: at its vertices, and on the faces between.

Samples by area meet a small part a few times, and the vertices of coarse faces say little of what
lies between them: of a knob that has slid along a plate the corners lie on the plate. So faces are
divided where they may be farther away than anything found so far.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from meshcone.surface import Mesh, SurfaceTree
from meshcone.surface.arrays import Floats, Ints, row_lengths

# How many triangles are divided at each depth, those first that may be the farthest. On a finer
# mesh, those left out lie close to their corners.
_DIVIDED = (10_000, 4_000, 2_000, 2_000)


@dataclass(frozen=True)
class Beyond:
    """What of a mesh is farther from another than a limit.

    Attributes:
        vertices: (k,) those of the mesh that are, or are corners of a face that is somewhere.
        points: (j, 3) where.
    """

    vertices: Ints
    points: Floats


def largest_distance(mesh: Mesh, tree: SurfaceTree, least: float) -> float:
    """Return the largest distance of a mesh's vertices and faces that is found.

    Args:
        mesh: the mesh.
        tree: of the other.
        least: a distance below which it does not matter which is the largest.
    """
    at_vertices = _at_vertices(mesh, tree)
    largest = max(float(at_vertices.max(initial=0.0)), least)
    triangles = _Triangles.of(mesh, at_vertices)
    for most in _DIVIDED:
        triangles = triangles.beyond(largest, most).divided(tree)
        largest = max(largest, float(triangles.distances.max(initial=0.0)))
    return largest


def largest_at_vertices(mesh: Mesh, tree: SurfaceTree) -> float:
    """Return the largest distance of a mesh's vertices."""
    return float(_at_vertices(mesh, tree).max(initial=0.0))


def beyond(mesh: Mesh, tree: SurfaceTree, limit: float) -> Beyond:
    """Find what of a mesh's vertices and faces is farther than a limit."""
    at_vertices = _at_vertices(mesh, tree)
    far = np.flatnonzero(at_vertices > limit)
    vertices, points = [far], [mesh.vertices[far]]
    triangles = _Triangles.of(mesh, at_vertices)
    for most in _DIVIDED:
        triangles = triangles.beyond(limit, most).divided(tree)
        found = triangles.distances > limit
        vertices.append(mesh.faces[triangles.faces[found.any(axis=1)]].ravel())
        points.append(triangles.corners[found])
    return Beyond(np.unique(np.concatenate(vertices)), np.concatenate(points))


def _at_vertices(mesh: Mesh, tree: SurfaceTree) -> Floats:
    """Return the distance of each vertex, (n,); 0 of those that no face uses."""
    distances, used = np.zeros(len(mesh.vertices)), mesh.used_vertices
    distances[used] = tree.closest(mesh.vertices[used]).distances
    return distances


@dataclass(frozen=True)
class _Triangles:
    """Faces of a mesh, or what they were divided into.

    Attributes:
        faces: (t,) the face each is of.
        corners: (t, 3, 3) where its corners are.
        distances: (t, 3) how far these are from the other mesh.
    """

    faces: Ints
    corners: Floats
    distances: Floats

    @staticmethod
    def of(mesh: Mesh, at_vertices: Floats) -> _Triangles:
        return _Triangles(np.arange(len(mesh.faces)), mesh.corners, at_vertices[mesh.faces])

    def beyond(self, limit: float, most: int) -> _Triangles:
        """Keep those that may be farther than a limit, so many of them."""
        sides = self.corners - np.roll(self.corners, 1, axis=1)  # to each corner from the last
        lengths = row_lengths(sides.reshape(-1, 3)).reshape(-1, 3)
        # Nothing is farther away than a corner and the way there.
        ways = np.maximum(lengths, np.roll(lengths, -1, axis=1))
        bounds = (self.distances + ways).min(axis=1)
        chosen = np.flatnonzero(bounds > limit)
        chosen = np.sort(chosen[np.argsort(-bounds[chosen], kind="stable")[:most]])
        return _Triangles(self.faces[chosen], self.corners[chosen], self.distances[chosen])

    def divided(self, tree: SurfaceTree) -> _Triangles:
        """Divide each in four by the middles of its sides."""
        middles = (self.corners + np.roll(self.corners, -1, axis=1)) / 2
        found = tree.closest(middles.reshape(-1, 3)).distances.reshape(-1, 3)
        corners = np.concatenate([self.corners, middles], axis=1)
        distances = np.concatenate([self.distances, found], axis=1)
        # Middle k, the column 3 + k, lies between the corners k and k + 1.
        parts = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])
        return _Triangles(
            np.repeat(self.faces, 4),
            corners[:, parts].reshape(-1, 3, 3),
            distances[:, parts].reshape(-1, 3),
        )
