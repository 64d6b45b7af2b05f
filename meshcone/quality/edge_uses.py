"""Which faces meet at each edge, and which way they run along it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from meshcone.quality.thin_faces import Meetings, ThinFaces
from meshcone.surface import Mesh
from meshcone.surface.arrays import Ints


@dataclass(frozen=True)
class EdgeUses:
    """The sides of all faces, grouped by the edge they lie on.

    Attributes:
        mesh: the mesh.
        side_edges: (3m,) the edge of each side: of all faces' first sides, then their second
            and their third; edges are numbered from 0.
        upward: (3m,) whether the side runs from its smaller to its larger vertex index.
        counts: (e,) number of sides on each edge.
    """

    mesh: Mesh
    side_edges: Ints
    upward: np.ndarray
    counts: Ints

    @staticmethod
    def of(mesh: Mesh) -> EdgeUses:
        """Group the sides of a mesh."""
        ends = _sides(mesh)
        low, high = ends.min(axis=1), ends.max(axis=1)
        _, edges = np.unique(low * len(mesh.vertices) + high, return_inverse=True)
        return EdgeUses(mesh, edges, ends[:, 0] < ends[:, 1], np.bincount(edges))

    @property
    def opposed(self) -> int:
        """Edges of two faces that both run along it in the same direction."""
        return int(np.count_nonzero((self.counts == 2) & (self.upward_counts != 1)))

    @cached_property
    def thin_faces(self) -> ThinFaces:
        """The faces that have no normal."""
        return ThinFaces.of(self.mesh, _sides(self.mesh), self.side_edges)

    def meetings(self) -> Meetings:
        """Where two faces meet, at an edge of their own or across faces that have no normal.

        At an edge the first is the face that runs along it upward.
        """
        usable = (self.counts == 2) & (self.upward_counts == 1)
        chosen = np.flatnonzero(usable[self.side_edges])
        ordered = chosen[np.lexsort((~self.upward[chosen], self.side_edges[chosen]))]
        thin, across, count = self.thin_faces.thin, self.thin_faces.meetings(), len(self.mesh.faces)
        either = thin[ordered[::2] % count] | thin[ordered[1::2] % count]
        first, second = ordered[::2][~either], ordered[1::2][~either]
        ends = self.mesh.vertices[_sides(self.mesh)[first]]
        return Meetings(
            np.concatenate([first % count, across.first]),
            np.concatenate([second % count, across.second]),
            np.concatenate([ends[:, 0], across.start]),
            np.concatenate([ends[:, 1], across.end]),
            np.concatenate([np.arange(len(first)), len(first) + across.edges]),
        )

    @property
    def upward_counts(self) -> Ints:
        """(e,) number of sides on each edge that run upward."""
        return np.bincount(self.side_edges[self.upward], minlength=len(self.counts))


def _sides(mesh: Mesh) -> Ints:
    faces = mesh.faces
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
