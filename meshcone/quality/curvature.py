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

import numpy as np

from meshcone.quality.edge_uses import EdgeUses
from meshcone.surface.arrays import Floats, Ints, row_dot, row_lengths
from meshcone.surface.box_tree import BoxTree
from meshcone.surface.compiled import compiled

# A ball's radius, relative to the reference's: wide enough to hold some edges of a mesh of
# a few thousand vertices, narrow enough to stay on one side of most parts.
BALL_RADIUS = 0.1
_DEEPEST = 128  # a tree of edges is halved at most 63 times

_ROWS, _NUMBERS = "float64[:,::1]", "float64[::1]"


class CurvatureField:
    """Mean curvature of one mesh, anywhere near it."""

    def __init__(self, uses: EdgeUses) -> None:
        """Find the angle at each edge of exactly two faces that agree on what is outside.

        Faces without a normal are looked across. Other edges count as flat: an angle between
        more or fewer faces, or between an outside and an inside, has no meaning.
        """
        normals, met = uses.mesh.face_normals, uses.meetings()
        start, end = met.start, met.end
        lengths = row_lengths(end - start)
        normal, other = normals[met.first], normals[met.second]
        directions = (end - start) / np.maximum(lengths, 1e-300)[:, None]
        angles = np.arctan2(row_dot(np.cross(normal, other), directions), row_dot(normal, other))
        bent = (angles != 0) & (lengths > 0)
        ends = np.flatnonzero(bent)[:, None] + np.array([0, len(start), len(start)])
        tree = BoxTree.of(np.concatenate([start, end]), ends)
        self._nodes = tree.spans, tree.children, tree.boxes
        order = np.flatnonzero(bent)[tree.order]
        self._middles = ((start + end) / 2)[order]
        self._directions = directions[order]
        self._lengths, self._angles = lengths[order], angles[order]

    def at(self, points: Floats, radius: float) -> Floats:
        """Mean curvature over the ball around each of (k, 3) points, (k,), per unit of length.

        Args:
            points: centres of the balls, on the surface.
            radius: of the balls, in the mesh's unit.
        """
        total = np.zeros(len(points))
        if len(self._lengths):
            edges = self._middles, self._directions, self._lengths, self._angles
            _gather(np.require(points, np.float64, ["C", "W"]), radius, *self._nodes, *edges, total)
        return total / (2 * np.pi * radius**2)


@compiled()
def _is_within(x: float, y: float, z: float, boxes: Floats, node: int, radius: float) -> bool:
    dx = max(boxes[node, 0] - x, x - boxes[node, 3], 0.0)
    dy = max(boxes[node, 1] - y, y - boxes[node, 4], 0.0)
    dz = max(boxes[node, 2] - z, z - boxes[node, 5], 0.0)
    return bool(dx * dx + dy * dy + dz * dz <= radius * radius)


@compiled(
    f"void({_ROWS}, float64, int64[:,::1], int64[::1], {_ROWS}, {_ROWS}, {_ROWS}, {_NUMBERS},"
    f"{_NUMBERS}, {_NUMBERS})"
)
def _gather(
    points: Floats,
    radius: float,
    spans: Ints,
    children: Ints,
    boxes: Floats,
    middles: Floats,
    directions: Floats,
    lengths: Floats,
    angles: Floats,
    total: Floats,
) -> None:
    """Add to each point the angles of the edges in its ball, times their lengths in there."""
    waiting = np.empty(_DEEPEST, np.int64)
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        top, waiting[0] = 1, 0
        while top:
            top -= 1
            node = waiting[top]
            if not _is_within(x, y, z, boxes, node, radius):
                continue
            if children[node] >= 0:
                waiting[top], waiting[top + 1] = children[node], children[node] + 1
                top += 2
                continue
            for edge in range(spans[node, 0], spans[node, 1]):
                dx, dy, dz = x - middles[edge, 0], y - middles[edge, 1], z - middles[edge, 2]
                along = dx * directions[edge, 0] + dy * directions[edge, 1]
                along += dz * directions[edge, 2]
                half_edge = lengths[edge] / 2
                squared = radius * radius - (dx * dx + dy * dy + dz * dz) + along * along
                half_chord = np.sqrt(max(squared, 0.0))
                high = min(along + half_chord, half_edge)
                low = max(along - half_chord, -half_edge)
                total[i] += angles[edge] * max(high - low, 0.0)
