"""How well normals agree with those of the closest triangles, where several are equally close."""

from __future__ import annotations

from functools import cached_property
from typing import Literal

import numpy as np

from meshcone.quality.edge_uses import EdgeUses
from meshcone.surface.arrays import Floats, Ints, row_dot, row_lengths
from meshcone.surface.closest import ClosestPoints, barycentric_weights

# A barycentric coordinate below this is one of a point on the opposite side.
_ON_SIDE = 1e-9
# A point this near to a line that thin faces lie on is on it, relative to the line's length.
_ON_LINE = 1e-5
# Lines with more sides than this, of fans without area, are not looked across.
_MOST_SIDES = 1000
_WAYS: tuple[Literal["left"], Literal["right"]] = ("left", "right")


class ClosestNormals:
    """The face normals of a mesh, by the faces, edges and vertices closest points lie on.

    Near a convex edge or corner whole regions have their closest point on it. Which of the
    triangles that meet there a search returns is chance; the one whose normal agrees best is not.
    Faces that have no normal are looked across.
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
        face_normals, thin = self._mesh.face_normals, self._uses.thin_faces.thin
        owners, faces = self._touching(closest)
        solid = ~thin[faces]
        across = self._across(closest.points, owners[~solid], faces[~solid])
        best = np.full(len(normals), np.inf)
        for points, found in ((owners[solid], faces[solid]), across):
            np.minimum.at(best, points, _chords(normals[points], face_normals[found]))
        alone = np.isinf(best)
        best[alone] = _chords(normals[alone], face_normals[closest.faces[alone]])
        return best

    def _touching(self, closest: ClosestPoints) -> tuple[Ints, Ints]:
        """Points and faces that they lie in, on an edge of or at a vertex of: (n,) of each."""
        mesh, faces = self._mesh, closest.faces
        away = barycentric_weights(closest.points, mesh, faces) < _ON_SIDE
        on_edge, on_vertex = (np.flatnonzero(away.sum(axis=1) == count) for count in (1, 2))
        # The side opposite a face's corner begins at the next one.
        side = (np.argmax(away[on_edge], axis=1) + 1) % 3
        edges = self._uses.side_edges[side * len(mesh.faces) + faces[on_edge]]
        vertices = mesh.faces[faces[on_vertex], np.argmin(away[on_vertex], axis=1)]
        # A face without a normal has no coordinates that tell.
        without = np.flatnonzero(self._uses.thin_faces.thin[faces])
        corners = mesh.corners[faces[without]]
        apart = np.linalg.norm(corners - closest.points[without, None], axis=2)
        reach = _ON_LINE * np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
        at, corner = np.nonzero(apart <= reach.max(axis=1, initial=0)[:, None])
        on_vertex = np.concatenate([on_vertex, without[at]])
        vertices = np.concatenate([vertices, mesh.faces[faces[without[at]], corner]])
        found = (
            (np.arange(len(faces)), faces),
            _members(self._around_edges, on_edge, edges),
            _members(self._around_vertices, on_vertex, vertices),
        )
        owners, around = (np.concatenate(parts) for parts in zip(*found, strict=True))
        return owners, around

    def _across(self, points: Floats, owners: Ints, faces: Ints) -> tuple[Ints, Ints]:
        """Points and the faces with a normal that meet there across the thin ones they touch."""
        thin = self._uses.thin_faces
        if not len(owners):
            return owners, faces
        owners, lines = np.unique(np.stack([owners, thin.lines[faces]]), axis=1)
        starts, ends = (np.searchsorted(thin.line_of_side, lines, way) for way in _WAYS)
        few = ends - starts <= _MOST_SIDES
        owners, chosen = _expanded(owners[few], starts[few], (ends - starts)[few])
        start, end = (each[chosen] for each in thin.side_ends)
        along, lengths = end - start, thin.line_lengths[chosen]
        share = row_dot(points[owners] - start, along) / row_dot(along, along)
        nearest = start + share.clip(0, 1)[:, None] * along
        on_it = row_lengths(points[owners] - nearest) <= _ON_LINE * lengths
        return owners[on_it], thin.sides[chosen[on_it]] % len(self._mesh.faces)

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


def _members(around: tuple[Ints, Ints], owners: Ints, keys: Ints) -> tuple[Ints, Ints]:
    """Each owner as often as there are faces around its key, and those faces."""
    starts, faces = around
    owners, places = _expanded(owners, starts[keys], starts[keys + 1] - starts[keys])
    return owners, faces[places]


def _expanded(owners: Ints, starts: Ints, counts: Ints) -> tuple[Ints, Ints]:
    """Each owner as often as it counts, and as many places from its start on."""
    within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.repeat(owners, counts), np.repeat(starts, counts) + within


def _grouped(keys: Ints, count: int, faces: int) -> tuple[Ints, Ints]:
    """Faces by a key of each of their sides or corners: where each key's begin, and the faces."""
    order = np.argsort(keys, kind="stable")
    starts = np.concatenate([[0], np.cumsum(np.bincount(keys, minlength=count))])
    return starts, order % faces
