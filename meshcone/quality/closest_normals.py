"""How well normals agree with those of the closest triangles, where several are equally close."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from meshcone.quality.edge_uses import EdgeUses
from meshcone.surface.arrays import Floats, Ints, row_dot, row_lengths
from meshcone.surface.closest import ClosestPoints, barycentric_weights

# A barycentric coordinate below this is one of a point on the opposite side.
_ON_SIDE = 1e-9


class ClosestNormals:
    """The face normals of a mesh, by the faces, edges and vertices closest points lie on.

    Near a convex edge or corner whole regions have their closest point on it. Which of the
    triangles that meet there a search returns is chance; the one whose normal agrees best is not.
    """

    def __init__(self, uses: EdgeUses) -> None:
        """Prepare the mesh of ``uses``."""
        self._uses = uses
        self._mesh = uses.mesh

    def chords(self, normals: Floats, closest: ClosestPoints) -> Floats:
        """Smallest ‖n ∓ n'‖ over the triangles equally close to each point, (k,).

        It is 2 sin(α/2) of the angle between the normals' lines, and keeps the digits of a
        small angle that their cosine loses.

        Args:
            normals: (k, 3) unit normals at the points searched from.
            closest: what the search found.
        """
        mesh, faces = self._mesh, closest.faces
        best = _chords(normals, mesh.face_normals[faces])
        away = barycentric_weights(closest.points, mesh, faces) < _ON_SIDE
        on_edge, on_vertex = (np.flatnonzero(away.sum(axis=1) == count) for count in (1, 2))
        # The side opposite a face's corner begins at the next one.
        side = (np.argmax(away[on_edge], axis=1) + 1) % 3
        edges = self._uses.side_edges[side * len(mesh.faces) + faces[on_edge]]
        self._lower_to_best(best, on_edge, normals, self._around_edges, edges)
        corner = np.argmin(away[on_vertex], axis=1)
        vertices = mesh.faces[faces[on_vertex], corner]
        self._lower_to_best(best, on_vertex, normals, self._around_vertices, vertices)
        return best

    def _lower_to_best(
        self, best: Floats, points: Ints, normals: Floats, around: tuple[Ints, Ints], keys: Ints
    ) -> None:
        starts, faces = around
        counts = starts[keys + 1] - starts[keys]
        owners = np.repeat(points, counts)
        within = np.arange(len(owners)) - np.repeat(np.cumsum(counts) - counts, counts)
        chosen = faces[np.repeat(starts[keys], counts) + within]
        np.minimum.at(best, owners, _chords(normals[owners], self._mesh.face_normals[chosen]))

    @cached_property
    def _around_edges(self) -> tuple[Ints, Ints]:
        return _grouped(self._uses.side_edges, len(self._uses.counts), len(self._mesh.faces))

    @cached_property
    def _around_vertices(self) -> tuple[Ints, Ints]:
        corners = self._mesh.faces.T.ravel()
        return _grouped(corners, len(self._mesh.vertices), len(self._mesh.faces))


def _chords(normals: Floats, others: Floats) -> Floats:
    sign = np.where(row_dot(normals, others) < 0, -1.0, 1.0)[:, None]
    return row_lengths(normals - sign * others)


def _grouped(keys: Ints, count: int, faces: int) -> tuple[Ints, Ints]:
    """Faces by a key of each of their sides or corners: where each key's begin, and the faces."""
    order = np.argsort(keys, kind="stable")
    starts = np.concatenate([[0], np.cumsum(np.bincount(keys, minlength=count))])
    return starts, order % faces
