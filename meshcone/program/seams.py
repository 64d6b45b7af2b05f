"""Borders that lie on each other, moved as one.

Exporters write the two sides of a seam between nodes or primitives in different frames, or
rounded apart: the file's vertices are not equal, and a solver would see two open borders and
tear them apart. Here their vertices become one vertex of the program. What is written moves
each of them by what it moved, so that a gap neither opens nor closes. Where the two sides have
their vertices in different places, those within an edge of the other side follow that edge.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from meshcone.program.ties import Ties
from meshcone.quality.contacts import GAP_OVER_EDGE, border_contacts, reaches
from meshcone.surface import Mesh
from meshcone.surface.arrays import Bools, Floats, Ints

# Pairs of border edges that are compared, some seconds' worth: of more, none are tied.
_MOST_PAIRS = 5_000_000
# Nearest border vertices looked at: a mesh far smaller than its reference has all within reach.
_NEIGHBOURS = 8


@dataclass(frozen=True)
class Seams:
    """Which vertices of a mesh are one vertex of the program.

    Attributes:
        source: (n) vertices, the mesh.
        joined: (k) vertices, the same faces over one vertex for each group.
        group: (n,) the vertex of ``joined`` that each vertex belongs to.
        first: (k,) the first vertex of each group, at whose position it is.
        ties: which vertices of ``joined`` follow an edge that they lie on, if any do.
    """

    source: Mesh
    joined: Mesh
    group: Ints
    first: Ints
    ties: Ties | None = None

    @staticmethod
    def of(source: Mesh) -> Seams:
        """Join vertices of open borders that lie on each other, where no face is lost by it.

        Those that lie within an edge are tied to it.

        Args:
            source: in the reference's frame, where its radius is 1.
        """
        count = len(source.vertices)
        near = _near_borders(source)
        graph = sparse.coo_array((np.ones(len(near)), (near[:, 0], near[:, 1])), (count, count))
        near_labels: Ints = connected_components(graph, directed=False)[1].astype(np.int64)
        labels = _apart(near_labels, _flattening(source, near_labels))
        _, appearance, member = np.unique(labels, return_index=True, return_inverse=True)
        order = np.argsort(appearance)  # groups in the order of their first vertices
        first = appearance[order].astype(np.int64)
        group = np.argsort(order)[member].astype(np.int64)
        joined = source
        if len(first) < count:
            precision = None if source.precision is None else source.precision[first]
            joined = Mesh(source.vertices[first], group[source.faces], precision=precision)
        contacts = border_contacts(joined, _MOST_PAIRS, source.border_sides)
        return Seams(source, joined, group, first, Ties.of(joined.vertices, contacts))

    @property
    def trivial(self) -> bool:
        """Whether every vertex is its own group."""
        return len(self.first) == len(self.group)

    def settled(self, positions: Floats) -> Floats:
        """Put vertices at (k, 3) positions of the program exactly on what they follow."""
        return positions if self.ties is None else self.ties.settled(positions)

    def gathered(self, positions: Floats) -> Floats:
        """Take (n, 3) positions of the mesh to the program's, (k, 3)."""
        return positions if self.trivial else positions[self.first]

    def spread(self, positions: Floats) -> Floats:
        """Move every vertex of the mesh as its group moved to (k, 3) positions, (n, 3)."""
        if self.trivial:
            return positions
        return self.source.vertices + (positions - self.joined.vertices)[self.group]


def _near_borders(mesh: Mesh) -> Ints:
    """Find pairs of border vertices that lie on each other, (p, 2)."""
    border = np.flatnonzero(mesh.border_vertices)
    if not len(border):
        return np.empty((0, 2), dtype=np.int64)
    ends, lengths = mesh.edges.ravel(), np.repeat(mesh.edge_lengths, 2)
    degree = np.maximum(np.bincount(ends, minlength=len(mesh.vertices)), 1)
    mean = np.bincount(ends, lengths, minlength=len(mesh.vertices)) / degree
    reach = reaches(mesh)
    allowed = np.minimum(reach, GAP_OVER_EDGE * mean)
    points = mesh.vertices[border]
    farthest = float(reach[border].max())
    found = cKDTree(points).query(points, k=_NEIGHBOURS + 1, distance_upper_bound=farthest)
    gaps, others = np.asarray(found[0]), np.asarray(found[1])
    one, place = np.nonzero(others < len(border))  # the tree's length where there is no other
    pairs = border[np.stack([one, others[one, place]], axis=1)]
    joined = (gaps[one, place] <= allowed[pairs].min(axis=1)) & (pairs[:, 0] < pairs[:, 1])
    return np.asarray(pairs[joined])


def _flattening(mesh: Mesh, group: Ints) -> Ints:
    """Name the groups that two corners of one face belong to."""
    corners = group[mesh.faces]
    following = np.roll(corners, -1, axis=1)
    return np.unique(corners[corners == following])


def _apart(group: Ints, dissolved: Ints) -> Ints:
    """Give the vertices of some groups a group each."""
    alone: Bools = np.isin(group, dissolved)
    return np.asarray(np.where(alone, len(group) + np.arange(len(group)), group))
