"""The surface of an asset: what is wrong with it, and what it encloses."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from meshcone.auditing.pieces import Pieces
from meshcone.auditing.records.geometry import Geometry
from meshcone.auditing.subject import Subject
from meshcone.quality.edge_uses import EdgeUses
from meshcone.quality.records import Validity
from meshcone.quality.validity import inspect
from meshcone.surface import Mesh
from meshcone.surface.arrays import Floats, row_dot, row_lengths

HARD_EDGE_DEGREES = 30.0
SHARP_EDGE_DEGREES = 89.0
DEBRIS_SHARE = 0.01
"""Of the whole asset's diagonal."""

_SLIVER = 0.01  # height over the longest side
_ON_EDGE = 1e-6  # of the diagonal: how near a vertex is on an edge
_MOST_NEIGHBOURS = 5_000_000
_PAIRS_PER_FACE = 100


def geometry_of(subject: Subject, validity: Validity | None = None) -> Geometry:
    """Count the defects of a surface.

    Args:
        subject: the asset.
        validity: what was counted before, if it was.
    """
    mesh = subject.mesh
    uses = EdgeUses.of(mesh)
    found = validity or inspect(mesh, _PAIRS_PER_FACE * len(mesh.faces))
    pieces, shells = Pieces.by_vertices(mesh, uses), Pieces.by_edges(mesh, uses)
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
        inside_out_share=shells.inside_out_share(),
        area=float(mesh.face_areas.sum()),
        volume=shells.volume() if pieces.closed.all() else None,
    )


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
