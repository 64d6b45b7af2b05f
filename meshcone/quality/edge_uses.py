"""Which faces meet at each edge, and which way they run along it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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

    def manifold_pairs(self) -> tuple[Ints, Ints, Ints]:
        """Edges of two faces that agree on what is outside.

        Returns:
            (k,) the face that runs along the edge upward, (k,) the other face, and (k, 2)
            the edge's ends in the direction of the first.
        """
        usable = (self.counts == 2) & (self.upward_counts == 1)
        chosen = np.flatnonzero(usable[self.side_edges])
        ordered = chosen[np.lexsort((~self.upward[chosen], self.side_edges[chosen]))]
        first, second = ordered[::2], ordered[1::2]
        faces = len(self.mesh.faces)
        return first % faces, second % faces, _sides(self.mesh)[first]

    @property
    def upward_counts(self) -> Ints:
        """(e,) number of sides on each edge that run upward."""
        return np.bincount(self.side_edges[self.upward], minlength=len(self.counts))


def _sides(mesh: Mesh) -> Ints:
    faces = mesh.faces
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
