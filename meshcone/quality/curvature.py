"""Mean curvature of a triangle mesh at a scale: the normal cycle's measure of a ball.

Cohen-Steiner & Morvan, "Restricted Delaunay triangulations and normal cycle" (2003): the
mean curvature of a triangle mesh lives on its edges, and over a ball B it adds up to
½ Σ β(e) · length(e ∩ B), where β is the angle between the normals of the edge's two faces,
positive where the surface is convex. Divided by the area π r² that a smooth surface has in a
small ball it is the mean curvature H there, up to O(r).

Unlike H at a vertex by cotangents it does not depend on how the surface is cut into
triangles, does not grow without bound along a sharp edge of a finer mesh, and an open border,
which has no curvature, adds nothing to it.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial import KDTree

from meshcone.quality.edge_uses import EdgeUses
from meshcone.surface.arrays import Floats, Ints, row_dot, row_lengths

# A ball's radius, relative to the reference's: wide enough to hold some edges of a mesh of
# a few thousand vertices, narrow enough to stay on one side of most parts.
BALL_RADIUS = 0.1
_EDGES_AT_ONCE = 100_000
_PAIRS_AT_ONCE = 2_000_000  # of a point and an edge: about 150 bytes each
_SHORT = 0.5  # radii; edges shorter than that are searched together


class CurvatureField:
    """Mean curvature of one mesh, anywhere near it."""

    def __init__(self, uses: EdgeUses) -> None:
        """Find the angle at each edge of exactly two faces that agree on what is outside.

        Other edges count as flat: an angle between more or fewer faces, or between an outside
        and an inside, has no meaning.
        """
        mesh = uses.mesh
        first, second, ends = uses.manifold_pairs()
        start, end = mesh.vertices[ends[:, 0]], mesh.vertices[ends[:, 1]]
        lengths = row_lengths(end - start)
        normal, other = mesh.face_normals[first], mesh.face_normals[second]
        directions = (end - start) / np.maximum(lengths, 1e-300)[:, None]
        angles = np.arctan2(row_dot(np.cross(normal, other), directions), row_dot(normal, other))
        bent = (angles != 0) & (lengths > 0)
        self._middles = ((start + end) / 2)[bent]
        self._directions = directions[bent]
        self._lengths, self._angles = lengths[bent], angles[bent]

    def at(self, points: Floats, radius: float) -> Floats:
        """Mean curvature over the ball around each of (k, 3) points, (k,), per unit of length.

        Args:
            points: centres of the balls, on the surface.
            radius: of the balls, in the mesh's unit.
        """
        total = np.zeros(len(points))
        for edges in self._by_length(radius):
            reach = radius + float(self._lengths[edges].max()) / 2
            middles = KDTree(self._middles[edges])
            for centres in _blocks(middles, points, reach):
                tree = KDTree(points[centres])
                near = tree.sparse_distance_matrix(middles, reach, output_type="ndarray")
                near = near[near["v"] < radius + self._lengths[edges[near["j"]]] / 2]
                around, chosen = centres[near["i"]], edges[near["j"]]
                inside = self._inside(chosen, points[around], near["v"], radius)
                total += np.bincount(around, self._angles[chosen] * inside, minlength=len(points))
        return total / (2 * np.pi * radius**2)

    def _by_length(self, radius: float) -> Iterator[Ints]:
        """Edges in groups, so that one long edge does not widen the search for all."""
        powers = np.ceil(np.log2(np.maximum(self._lengths / radius, _SHORT)))
        for power in np.unique(powers):
            group = np.flatnonzero(powers == power)
            for begin in range(0, len(group), _EDGES_AT_ONCE):
                yield group[begin : begin + _EDGES_AT_ONCE]

    def _inside(self, edges: Ints, centres: Floats, distances: Floats, radius: float) -> Floats:
        """Length of each edge inside the ball around a centre, given how far its middle is."""
        along = row_dot(centres - self._middles[edges], self._directions[edges])
        half_chord = np.sqrt(np.maximum(radius**2 - distances**2 + along**2, 0))
        half_edge = self._lengths[edges] / 2
        high = np.minimum(along + half_chord, half_edge)
        low = np.maximum(along - half_chord, -half_edge)
        return np.asarray(np.maximum(high - low, 0))


def _blocks(middles: KDTree, points: Floats, reach: float) -> Iterator[Ints]:
    """Cut the points into blocks whose balls together meet a bounded number of edges."""
    if len(points) * middles.n <= _PAIRS_AT_ONCE:
        yield np.arange(len(points))
        return
    met = np.cumsum(middles.query_ball_point(points, reach, return_length=True))
    yield from np.split(np.arange(len(points)), np.flatnonzero(np.diff(met // _PAIRS_AT_ONCE)) + 1)
