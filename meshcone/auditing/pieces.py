"""The parts of a surface, and which of them are solids, cavities or inside out."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from meshcone.quality.edge_uses import EdgeUses
from meshcone.surface import Mesh
from meshcone.surface.arrays import Bools, Floats, Ints, row_dot, row_lengths

_DIRECTIONS = np.concatenate([np.eye(3), -np.eye(3)])  # of a piece's corners that are tested
_MOST_TESTED = 50_000  # corners of all pieces; one of each is, however many there are
_ENCLOSED = 0.5  # of a winding number
_AWAY = 1e-6  # of a piece's diagonal: how far from it tests are made
_ROUNDING = 1e-14  # of the largest coordinate


@dataclass(frozen=True)
class Pieces:
    """Parts of a surface.

    Attributes:
        mesh: the surface.
        of_face: (m,) which part each face is of.
        areas: (p,) of each.
        volumes: (p,) signed, about any point for those that are closed.
        closed: (p,) whether every edge has two faces of the part that agree on what is outside.
        low, high: (p, 3) corners of each box.
    """

    mesh: Mesh
    of_face: Ints
    areas: Floats
    volumes: Floats
    closed: Bools
    low: Floats
    high: Floats

    @staticmethod
    def by_vertices(mesh: Mesh, uses: EdgeUses) -> Pieces:
        """Parts that share no vertex."""
        edges, count = mesh.edges, len(mesh.vertices)
        of_vertex = _connected(edges[:, 0], edges[:, 1], count)
        return Pieces._of(mesh, uses, of_vertex[mesh.faces[:, 0]])

    @staticmethod
    def by_edges(mesh: Mesh, uses: EdgeUses) -> Pieces:
        """Parts that hang together at edges of two faces that agree, and may touch elsewhere."""
        usable = (uses.counts == 2) & (uses.upward_counts == 1)
        sides = np.flatnonzero(usable[uses.side_edges])
        count = len(mesh.faces)
        joined = sides[np.argsort(uses.side_edges[sides], kind="stable")] % count
        return Pieces._of(mesh, uses, _connected(joined[::2], joined[1::2], count))

    @staticmethod
    def _of(mesh: Mesh, uses: EdgeUses, labels: Ints) -> Pieces:
        _, of_face = np.unique(labels, return_inverse=True)
        pieces = int(of_face.max()) + 1
        corners = mesh.corners - mesh.corners.mean(axis=(0, 1))
        signed = row_dot(corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
        low, high = np.full((pieces, 3), np.inf), np.full((pieces, 3), -np.inf)
        np.minimum.at(low, of_face, mesh.corners.min(axis=1))
        np.maximum.at(high, of_face, mesh.corners.max(axis=1))
        return Pieces(
            mesh=mesh,
            of_face=of_face,
            areas=np.asarray(np.bincount(of_face, mesh.face_areas), dtype=np.float64),
            volumes=np.asarray(np.bincount(of_face, signed), dtype=np.float64),
            closed=_closed(uses, of_face, pieces),
            low=low,
            high=high,
        )

    @property
    def diagonals(self) -> Floats:
        """(p,) lengths of the boxes' diagonals."""
        return row_lengths(self.high - self.low)

    def inside_out_share(self) -> float:
        """Share of the area in closed pieces that face inwards and are not cavities."""
        return float(self.areas[self._inside_out].sum()) / (float(self.areas.sum()) or 1.0)

    def volume(self) -> float:
        """What the closed pieces enclose, whichever way they face."""
        # A solid with a cavity that is inside out as a whole has its cavity facing outwards.
        outwards = self.closed & (self.volumes > 0)
        hollow = self._cavities
        if self._inside_out.any():
            hollow = hollow | self._within(outwards, -1)
        return float(np.where(hollow, -1, 1) @ np.where(self.closed, np.abs(self.volumes), 0.0))

    @cached_property
    def _cavities(self) -> Bools:
        """(p,) closed pieces that face inwards within what all others fill."""
        return self._within(self.closed & (self.volumes < 0), 1)

    @cached_property
    def _inside_out(self) -> Bools:
        """(p,) closed pieces that face inwards and are not cavities."""
        return self.closed & (self.volumes < 0) & ~self._cavities

    def _within(self, some: Bools, sign: int) -> Bools:
        """(p,) which of some pieces lie where all other closed ones wind around, at all tests."""
        found = np.zeros(len(self.areas), dtype=bool)
        pieces = np.flatnonzero(some)
        if not len(pieces):
            return found
        around = Mesh(self.mesh.vertices, self.mesh.faces[self.closed[self.of_face]])
        enclosed = np.ones(len(pieces), dtype=bool)
        tested = np.zeros(len(pieces), dtype=bool)
        for direction in _DIRECTIONS[: max(1, _MOST_TESTED // len(pieces))]:
            places, alone = self._farthest(pieces, direction)
            windings = np.atleast_1d(around.windings.winding_number(places))
            enclosed &= (sign * windings > _ENCLOSED) | ~alone
            tested |= alone
        found[pieces[enclosed & tested]] = True
        return found

    def _farthest(self, pieces: Ints, direction: Floats) -> tuple[Floats, Bools]:
        """(k, 3) places just beyond a corner of each piece, and whether no other piece has that.

        There the piece itself has no winding number, so that what all have is that of the others.
        """
        rows = np.full(len(self.areas), -1)
        rows[pieces] = np.arange(len(pieces))
        chosen = rows[self.of_face] >= 0
        corners = self.mesh.faces[chosen].ravel()
        owners = np.repeat(rows[self.of_face[chosen]], 3)
        heights = self.mesh.vertices[corners] @ direction
        order = np.lexsort((self._shared[corners], -heights, owners))
        _, first = np.unique(owners[order], return_index=True)
        farthest = corners[order[first]]
        places = self.mesh.vertices[farthest]
        away = _AWAY * self.diagonals[pieces] + _ROUNDING * np.abs(places).max(axis=1)
        return places + away[:, None] * direction, ~self._shared[farthest]

    @cached_property
    def _shared(self) -> Bools:
        """(v,) whether faces of several pieces have a vertex."""
        low = np.full(len(self.mesh.vertices), len(self.areas))
        high = np.full(len(self.mesh.vertices), -1)
        owners = np.repeat(self.of_face, 3)
        np.minimum.at(low, self.mesh.faces.ravel(), owners)
        np.maximum.at(high, self.mesh.faces.ravel(), owners)
        return np.asarray(low < high)


def _connected(first: Ints, second: Ints, count: int) -> Ints:
    """(count,) the component of each of several things, some of which are joined."""
    graph = sparse.coo_array((np.ones(len(first)), (first, second)), (count, count))
    _, labels = connected_components(graph, directed=False)
    return np.asarray(labels, dtype=np.int64)


def _closed(uses: EdgeUses, of_face: Ints, pieces: int) -> Bools:
    owners = np.tile(of_face, 3)
    # An edge where two pieces touch is one of each.
    keys = owners * len(uses.counts) + uses.side_edges
    _, edges, counts = np.unique(keys, return_inverse=True, return_counts=True)
    upward = np.bincount(edges[uses.upward], minlength=len(counts))
    bad = (counts != 2) | (upward != 1)
    closed = np.ones(pieces, dtype=bool)
    closed[np.unique(owners[bad[edges]])] = False
    return closed
