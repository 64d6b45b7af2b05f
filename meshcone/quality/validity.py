"""Counts that say whether a mesh is a well-formed surface."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from meshcone.quality.cracks import count_cracks
from meshcone.quality.edge_uses import EdgeUses
from meshcone.quality.intersections import count_self_intersections
from meshcone.quality.no_area import without_area
from meshcone.quality.records import Validity
from meshcone.surface import Mesh
from meshcone.surface.arrays import row_dot


def inspect(
    mesh: Mesh, intersection_pairs: int, before: Mesh | None = None, collapsed: int = 0
) -> Validity:
    """Count the defects of a welded mesh.

    Args:
        mesh: the mesh.
        intersection_pairs: pairs of faces that may be tested for self-intersections, and of
            border edges for cracks.
        before: the same faces over the positions they had in the input, if it is not the
            input itself; flipped faces are counted against it.
        collapsed: faces that the file lists and the mesh does not have, because corners of
            theirs are at one place. They count as degenerate.
    """
    if mesh.is_points:
        return _of_points()
    uses = EdgeUses.of(mesh)
    return Validity(
        watertight=bool(np.all(uses.counts == 2)),
        boundary_edges=int(np.count_nonzero(uses.counts == 1)),
        non_manifold_edges=int(np.count_nonzero(uses.counts > 2)),
        opposed_edges=uses.opposed,
        cracks=count_cracks(mesh, intersection_pairs),
        degenerate_faces=collapsed + int(np.count_nonzero(without_area(mesh))),
        duplicate_faces=_duplicates(mesh),
        flipped_faces=None if before is None else flipped_faces(before, mesh),
        self_intersections=count_self_intersections(mesh, intersection_pairs),
        components=_components(mesh),
    )


def _of_points() -> Validity:
    """Points have no defects that a surface can have."""
    return Validity(
        watertight=False,
        boundary_edges=0,
        non_manifold_edges=0,
        opposed_edges=0,
        cracks=None,
        degenerate_faces=0,
        duplicate_faces=0,
        flipped_faces=None,
        self_intersections=None,
        components=0,
    )


def flipped_faces(before: Mesh, after: Mesh) -> int:
    """Count the faces that turned by more than a right angle between two positions."""
    cosines = row_dot(before.face_normals, after.face_normals)
    return int(np.count_nonzero(cosines < 0))


def _duplicates(mesh: Mesh) -> int:
    """Count faces that have the same three vertices as one before."""
    low, middle, high = np.sort(mesh.faces, axis=1).T
    pair = low * len(mesh.vertices) + middle
    order = np.lexsort((high, pair))
    same = (np.diff(pair[order]) == 0) & (np.diff(high[order]) == 0)
    return int(np.count_nonzero(same))


def _components(mesh: Mesh) -> int:
    edges, count = mesh.edges, len(mesh.vertices)
    graph = sparse.coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), (count, count))
    _, labels = connected_components(graph, directed=False)
    return len(np.unique(labels[mesh.used_vertices]))
