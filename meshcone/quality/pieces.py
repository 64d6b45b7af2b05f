"""The connected pieces of a mesh, each held to what is allowed of it alone.

What is allowed of a whole mesh may be all of a small piece of it: a ring of a few hundred faces
can fall to a point, or through itself, beside a body of a hundred thousand.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from meshcone.surface import Mesh, SurfaceTree
from meshcone.surface.arrays import Bools, Floats, Ints

# Of one piece, opposed faces and crossing pairs may grow by so many, or by this share of its faces.
# A fold in one place makes several pairs.
_FEWEST_FACES, _FEWEST_PAIRS, _SHARE = 4, 8, 0.05
# A piece has shrunk if less than this share of its area is left and of its breadth, or next to
# nothing of its area. Noise has much area within little breadth: what is no broader than the noise
# is not judged.
_SHRUNK, _NOTHING_LEFT = 0.5, 0.02
# The reference vouches for a piece if what the piece is the closest to has this share of its area.
_VOUCHED = 0.05


@dataclass(frozen=True)
class Pieces:
    """The connected pieces of a mesh, by the faces.

    Attributes:
        labels: (m,) number of the piece each face belongs to.
        sizes: (p,) faces of each piece.
    """

    labels: Ints
    sizes: Ints

    @staticmethod
    def of(mesh: Mesh) -> Pieces:
        """Tell the pieces of a mesh apart."""
        edges, count = mesh.edges, len(mesh.vertices)
        graph = sparse.coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), (count, count))
        _, of_vertices = connected_components(graph, directed=False)
        _, labels = np.unique(of_vertices[mesh.faces[:, 0]], return_inverse=True)
        labels = labels.astype(np.int64)
        return Pieces(labels, np.bincount(labels).astype(np.int64))

    def beyond_allowed(self, faces: Ints) -> Ints:
        """Count by piece, (p,), how many more there are than may be new: of faces, or of pairs."""
        fewest = _FEWEST_FACES if faces.ndim == 1 else _FEWEST_PAIRS
        return self.counts(faces) - np.maximum(fewest, (_SHARE * self.sizes).astype(np.int64))

    def counts(self, faces: Ints) -> Ints:
        """Count entries by piece, (p,): of (k,) faces, or of (k, 2) pairs of them.

        A pair of faces counts once at each piece that it touches.
        """
        labels = self.labels[faces]
        if faces.ndim == 2:
            within = labels[:, 0] == labels[:, 1]
            labels = np.concatenate([labels[:, 0], labels[~within, 1]])
        return np.bincount(labels, minlength=len(self.sizes)).astype(np.int64)

    def shrunken(self, before: Mesh, after: Mesh, reference: Mesh, samples: Floats) -> Bools:
        """Find the pieces that have lost most of their area, (p,), and not to the reference.

        Args:
            before: the mesh.
            after: the same faces elsewhere.
            reference: what it should have been.
            samples: (k, 3) of that, by area.
        """
        area, left = (self._areas(mesh) for mesh in (before, after))
        found = left < _SHRUNK * area
        if not found.any():
            return found
        closest = SurfaceTree(before).closest(samples)
        # A piece that is larger than what it stands for shrinks rightly.
        truth = self.counts(closest.faces) / len(samples) * float(reference.face_areas.sum())
        found &= (truth < _VOUCHED * area) | (left < _SHRUNK * truth)
        was, now = (self._breadths(mesh) for mesh in (before, after))
        found &= was > float(closest.distances.mean())
        return np.asarray(found & ((now < _SHRUNK * was) | (left < _NOTHING_LEFT * area)))

    def _areas(self, mesh: Mesh) -> Floats:
        areas = np.bincount(self.labels, mesh.face_areas, minlength=len(self.sizes))
        return np.asarray(areas, dtype=np.float64)

    def _breadths(self, mesh: Mesh) -> Floats:
        """Return the spread of each piece along the second of its principal axes, (p,)."""
        corners = mesh.corners.reshape(-1, 3)
        labels = np.repeat(self.labels, 3)
        centred = corners - np.stack([self._means(labels, x) for x in corners.T], axis=1)[labels]
        spread = np.empty((len(self.sizes), 3, 3))
        for i in range(3):
            for j in range(3):
                spread[:, i, j] = self._means(labels, centred[:, i] * centred[:, j])
        return np.asarray(np.sqrt(np.maximum(np.linalg.eigvalsh(spread)[:, 1], 0)))

    def _means(self, labels: Ints, values: Floats) -> Floats:
        summed = np.bincount(labels, values, minlength=len(self.sizes))
        return np.asarray(summed / (3 * self.sizes))
