"""The surface of an asset: what is wrong with it, and what it encloses."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from meshcone.auditing.records.geometry import Geometry
from meshcone.auditing.subject import Subject
from meshcone.quality.edge_uses import EdgeUses
from meshcone.quality.records import Validity
from meshcone.quality.validity import inspect
from meshcone.surface import Mesh
from meshcone.surface.arrays import Bools, Floats, Ints, row_dot, row_lengths

HARD_EDGE_DEGREES = 30.0
SHARP_EDGE_DEGREES = 89.0
DEBRIS_SHARE = 0.01
"""Of the whole asset's diagonal."""

_SLIVER = 0.01  # height over the longest side
_ON_EDGE = 1e-6  # of the diagonal: how near a vertex is on an edge
_MOST_NEIGHBOURS = 5_000_000
_PAIRS_PER_FACE = 100
_DIRECTIONS = np.concatenate([np.eye(3), -np.eye(3)])  # of a piece's corners that are tested
_MOST_TESTED = 50_000  # corners of all pieces; one of each is, however many there are
_ENCLOSED = 0.5  # of a winding number


def geometry_of(subject: Subject, validity: Validity | None = None) -> Geometry:
    """Count the defects of a surface.

    Args:
        subject: the asset.
        validity: what was counted before, if it was.
    """
    mesh = subject.mesh
    uses = EdgeUses.of(mesh)
    found = validity or inspect(mesh, _PAIRS_PER_FACE * len(mesh.faces))
    pieces = _Pieces.of(mesh, uses)
    angles = _dihedral_degrees(mesh, uses)
    debris = pieces.diagonals < DEBRIS_SHARE * subject.diagonal
    return Geometry(
        watertight=found.watertight,
        boundary_edges=found.boundary_edges,
        non_manifold_edges=found.non_manifold_edges,
        opposed_edges=found.opposed_edges,
        degenerate_faces=int(np.count_nonzero(~subject.solid)),
        duplicate_faces=found.duplicate_faces,
        self_intersections=found.self_intersections,
        slivers=_slivers(mesh),
        hard_edges=int(np.count_nonzero(angles > HARD_EDGE_DEGREES)),
        sharp_edges=int(np.count_nonzero(angles >= SHARP_EDGE_DEGREES)),
        t_junctions=_t_junctions(mesh, uses, _ON_EDGE * subject.diagonal),
        isolated_vertices=_isolated(subject),
        pieces=len(pieces.areas),
        closed_pieces=int(np.count_nonzero(pieces.closed)),
        debris=int(np.count_nonzero(debris)),
        inside_out_share=pieces.inside_out_share(),
        area=float(mesh.face_areas.sum()),
        volume=pieces.volume(),
    )


@dataclass(frozen=True)
class _Pieces:
    """Parts of a surface.

    Attributes:
        areas: (p,) of each.
        volumes: (p,) signed, about any point for those that are closed.
        closed: (p,) whether every edge has two faces that agree on what is outside.
        low, high: (p, 3) corners of each box.
        mesh: the surface.
        of_face: (m,) which part each face is of.
    """

    mesh: Mesh
    of_face: Ints
    areas: Floats
    volumes: Floats
    closed: Bools
    low: Floats
    high: Floats

    @staticmethod
    def of(mesh: Mesh, uses: EdgeUses) -> _Pieces:
        edges, count = mesh.edges, len(mesh.vertices)
        graph = sparse.coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), (count, count))
        _, of_vertex = connected_components(graph, directed=False)
        _, of_face = np.unique(of_vertex[mesh.faces[:, 0]], return_inverse=True)
        pieces = int(of_face.max()) + 1
        corners = mesh.corners - mesh.corners.mean(axis=(0, 1))
        signed = row_dot(corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
        bad = (uses.counts != 2) | (uses.upward_counts != 1)
        open_pieces = np.unique(np.tile(of_face, 3)[bad[uses.side_edges]])
        closed = np.ones(pieces, dtype=bool)
        closed[open_pieces] = False
        low, high = np.full((pieces, 3), np.inf), np.full((pieces, 3), -np.inf)
        np.minimum.at(low, of_face, mesh.corners.min(axis=1))
        np.maximum.at(high, of_face, mesh.corners.max(axis=1))
        return _Pieces(
            mesh=mesh,
            of_face=of_face,
            areas=np.asarray(np.bincount(of_face, mesh.face_areas), dtype=np.float64),
            volumes=np.asarray(np.bincount(of_face, signed), dtype=np.float64),
            closed=closed,
            low=low,
            high=high,
        )

    @property
    def diagonals(self) -> Floats:
        """(p,) lengths of the boxes' diagonals."""
        return row_lengths(self.high - self.low)

    @cached_property
    def _cavities(self) -> Bools:
        """(p,) closed pieces that face inwards within those that face outwards."""
        return self._within(self.closed & (self.volumes < 0), self.closed & (self.volumes > 0))

    @cached_property
    def _inside_out(self) -> Bools:
        """(p,) closed pieces that face inwards and are not cavities."""
        return self.closed & (self.volumes < 0) & ~self._cavities

    def inside_out_share(self) -> float:
        """Share of the area in closed pieces that face inwards and are not cavities."""
        return float(self.areas[self._inside_out].sum()) / (float(self.areas.sum()) or 1.0)

    def volume(self) -> float | None:
        """What the pieces enclose, whichever way they face; None where one is open."""
        if not self.closed.all():
            return None
        # A solid with a cavity that is inside out as a whole has its cavity facing outwards.
        hollow = self._cavities | self._within(self.volumes > 0, self._inside_out)
        return float(np.where(hollow, -1, 1) @ np.abs(self.volumes))

    def _within(self, inner: Bools, outer: Bools) -> Bools:
        """(p,) which of some pieces lie within what others enclose."""
        found = np.zeros(len(self.areas), dtype=bool)
        pieces = np.flatnonzero(inner)
        if len(pieces) and outer.any():
            found[pieces[self._enclosed(pieces, outer)]] = True
        return found

    def _enclosed(self, pieces: Ints, outer: Bools) -> Bools:
        """(k,) which pieces lie within what the outer ones enclose, at all of a few corners."""
        rows = np.full(len(self.areas), -1)
        rows[pieces] = np.arange(len(pieces))
        corners = self.mesh.faces[rows[self.of_face] >= 0]
        owners = np.repeat(rows[self.of_face[rows[self.of_face] >= 0]], 3)
        directions = _DIRECTIONS[: max(1, _MOST_TESTED // len(pieces))]
        enclosed = np.ones(len(pieces), dtype=bool)
        around = Mesh(self.mesh.vertices, self.mesh.faces[outer[self.of_face]])
        for direction in directions:
            order = np.lexsort((self.mesh.vertices[corners.ravel()] @ direction, owners))
            _, first = np.unique(owners[order], return_index=True)
            farthest = self.mesh.vertices[corners.ravel()[order[first]]]
            windings = np.atleast_1d(around.windings.winding_number(farthest))
            enclosed &= np.abs(windings) > _ENCLOSED
        return enclosed


def _slivers(mesh: Mesh) -> int:
    sides = mesh.corners - np.roll(mesh.corners, 1, axis=1)
    longest = np.einsum("ijk,ijk->ij", sides, sides).max(axis=1)
    flat = 2 * mesh.face_areas < _SLIVER * longest
    return int(np.count_nonzero(flat & (mesh.face_areas > 0)))


def _dihedral_degrees(mesh: Mesh, uses: EdgeUses) -> Floats:
    """(k,) angle by which two faces are bent at each edge where just two agree.

    An edge that faces without a normal divide on one of its sides counts once.
    """
    met = uses.meetings()
    cosines = row_dot(mesh.face_normals[met.first], mesh.face_normals[met.second])
    least = np.ones(int(met.edges.max(initial=-1)) + 1)
    np.minimum.at(least, met.edges, cosines)
    return np.asarray(np.degrees(np.arccos(np.clip(least, -1, 1))))


def _isolated(subject: Subject) -> int:
    stored = subject.content.stored
    if stored is None:
        stored = np.arange(len(subject.asset.positions))
    # A vertex that several nodes place is one of the file.
    there, used = np.zeros((2, int(stored.max(initial=-1)) + 1), dtype=bool)
    there[stored] = True
    used[stored[subject.asset.triangles]] = True
    return int(np.count_nonzero(there & ~used))


def _t_junctions(mesh: Mesh, uses: EdgeUses, near: float) -> int | None:
    """Vertices of open borders within a border's edge; None where there are too many near."""
    sides = np.flatnonzero(uses.counts[uses.side_edges] == 1)
    faces = mesh.faces
    ends = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])[sides]
    vertices = np.unique(ends)
    if len(vertices) == 0:
        return 0
    start, end = mesh.vertices[ends[:, 0]], mesh.vertices[ends[:, 1]]
    lengths = row_lengths(end - start)
    tree = cKDTree(mesh.vertices[vertices])
    middles, reach = (start + end) / 2, lengths / 2 + near
    counts = tree.query_ball_point(middles, reach, return_length=True)
    if counts.sum() > _MOST_NEIGHBOURS:
        return None
    edge = np.repeat(np.arange(len(ends)), counts)
    found = np.concatenate(tree.query_ball_point(middles, reach)).astype(np.int64)
    points = mesh.vertices[vertices[found]]
    along = row_dot(points - start[edge], (end - start)[edge]) / np.maximum(lengths[edge], near)
    away = row_lengths(
        points - start[edge] - along[:, None] * (end - start)[edge] / lengths[edge, None]
    )
    on_edge = (away <= near) & (along > near) & (along < lengths[edge] - near)
    return len(np.unique(found[on_edge]))
