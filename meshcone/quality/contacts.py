"""Contacts: vertices of open borders that lie on another edge of a border.

Where two sheets meet on a line and divide it otherwise, a vertex of one lies within an edge of the
other. Nothing in the faces says that they belong together: only that they lie on each other does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from meshcone.quality.box_pairs import TooManyPairsError, overlapping_pairs
from meshcone.surface import Mesh
from meshcone.surface.arrays import Bools, Floats, Ints, row_dot, row_lengths, sorted_distinct
from meshcone.surface.box_tree import BoxTree

# What lies on a border is no farther from it than this share of the reference's radius, or than
# its file may have rounded two sides of a seam apart, and than this share of the edges there.
GAP, GAP_OVER_EDGE = 1e-4, 0.05
# Steps of a file between what was one place, and was rounded by a writer and by one before it.
_STEPS = 2 * 3**0.5


@dataclass(frozen=True)
class Contacts:
    """Vertices that lie on edges which they are no ends of.

    Attributes:
        vertices: (k,) the vertices.
        edges: (k, 2) the ends of the edge that each lies on.
        shares: (k,) where on it: 0 at its first end, 1 at its second.
        gaps: (k,) how far from it, relative to the reference's radius.
        inside: (k,) whether it lies farther from both ends than it may lie from the edge.
        rounding: (k,) what a gap may grow by in rounding alone, as the files' numbers are.
    """

    vertices: Ints
    edges: Ints
    shares: Floats
    gaps: Floats
    inside: Bools
    rounding: Floats

    def opened(self, positions: Floats) -> tuple[Bools, Floats]:
        """Find the contacts that are farther apart at (n, 3) positions than they were.

        Returns:
            (k,) which of them are, by more than counts as lying on each other; and (k,) how far
            apart all are there.
        """
        if not len(self.vertices):
            return np.zeros(0, dtype=bool), np.zeros(0)
        _, gaps = nearest_on_edges(positions[self.vertices], positions[self.edges])
        return gaps > self.gaps + self.rounding, gaps

    def touching(self, which: Bools) -> Ints:
        """List the vertices and the ends of edges of some contacts."""
        return np.concatenate([self.vertices[which], self.edges[which].ravel()])


def reaches(mesh: Mesh) -> Floats:
    """Return how far from each vertex of a mesh what lies on it may be, (n,).

    Args:
        mesh: in the reference's frame, where its radius is 1.
    """
    if mesh.precision is None:
        return np.full(len(mesh.vertices), GAP)
    return np.maximum(GAP, _STEPS * mesh.precision)


def border_contacts(mesh: Mesh, most_pairs: int, sides: Bools | None = None) -> Contacts:
    """Find the vertices of open borders that lie on an edge of a border, each edge once.

    Args:
        mesh: in the reference's frame, where its radius is 1.
        most_pairs: pairs of border edges that may be compared. Where there are more, none is found.
        sides: (m, 3) which sides of its faces are borders, where its own faces do not say it:
            those of a mesh some of whose vertices are one vertex here.
    """
    sides = mesh.border_sides if sides is None else sides
    ends = np.stack([mesh.faces[sides], np.roll(mesh.faces, -1, axis=1)[sides]], axis=1)
    opposite = np.roll(mesh.faces, -2, axis=1)[sides]
    lengths = row_lengths(mesh.vertices[ends[:, 1]] - mesh.vertices[ends[:, 0]])
    shortest = np.full(len(mesh.vertices), np.inf)
    np.minimum.at(shortest, ends.ravel(), np.repeat(lengths, 2))
    reach = reaches(mesh)
    vertices, edges = _close_pairs(mesh, ends, lengths, float(reach.max(initial=GAP)), most_pairs)
    own = (ends[edges] == vertices[:, None]).any(axis=1) | (opposite[edges] == vertices)
    vertices, edges = vertices[~own], edges[~own]
    shares, gaps = nearest_on_edges(mesh.vertices[vertices], mesh.vertices[ends[edges]])
    around = np.maximum(reach[vertices], reach[ends].max(axis=1)[edges])
    allowed = np.minimum(around, GAP_OVER_EDGE * np.minimum(lengths[edges], shortest[vertices]))
    # All of a hole that has shrunk to a dot lies on itself, and of a face without height.
    _, heights = nearest_on_edges(mesh.vertices[opposite], mesh.vertices[ends])
    kept = (gaps <= allowed) & (np.minimum(lengths, heights)[edges] > around)
    vertices, edges, shares, gaps = (a[kept] for a in (vertices, edges, shares, gaps))
    inside = np.minimum(shares, 1 - shares) * lengths[edges] > allowed[kept]
    # Both are written once more, and each of them half as far beside its place.
    rounding = np.maximum(GAP, around[kept] / 2)
    return Contacts(vertices, ends[edges], shares, gaps, inside, rounding)


def _close_pairs(
    mesh: Mesh, ends: Ints, lengths: Floats, reach: float, most_pairs: int
) -> tuple[Ints, Ints]:
    """Pair ends of edges with edges whose boxes are near, each pair once: (p,) and (p,)."""
    reach = min(reach, GAP_OVER_EDGE * float(lengths.max(initial=0.0)))
    tree = BoxTree.of(mesh.vertices, ends[:, [0, 1, 1]])
    found = [np.empty(0, dtype=np.int64)]
    try:
        for first, second in overlapping_pairs(tree, most_pairs, within=reach):
            for one, other in ((first, second), (second, first)):
                found.append((ends[one] * len(ends) + other[:, None]).ravel())
    except TooManyPairsError:
        found = found[:1]
    vertices, edges = np.divmod(sorted_distinct(np.concatenate(found)), max(len(ends), 1))
    return vertices, edges


def nearest_on_edges(points: Floats, edges: Floats) -> tuple[Floats, Floats]:
    """Return where on (k, 2, 3) edges (k, 3) points are nearest, as a share, and how far away."""
    start, along = edges[:, 0], edges[:, 1] - edges[:, 0]
    length = np.maximum(row_dot(along, along), 1e-300)
    shares = np.clip(row_dot(points - start, along) / length, 0, 1)
    return shares, row_lengths(points - start - shares[:, None] * along)
