"""Counts that say whether a mesh is a well-formed surface."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from meshcone.quality.records import Validity
from meshcone.surface import Mesh


def inspect(mesh: Mesh) -> Validity:
    """Count the defects of a welded mesh."""
    faces = mesh.faces
    ends = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    _, uses = np.unique(ends[:, 0] * len(mesh.vertices) + ends[:, 1], return_counts=True)
    longest_squared = np.max(
        np.sum((mesh.corners - np.roll(mesh.corners, -1, axis=1)) ** 2, axis=2), axis=1
    )
    distinct = np.unique(np.sort(faces, axis=1), axis=0)
    return Validity(
        watertight=bool(np.all(uses == 2)),
        boundary_edges=int(np.count_nonzero(uses == 1)),
        non_manifold_edges=int(np.count_nonzero(uses > 2)),
        degenerate_faces=int(np.count_nonzero(mesh.face_areas <= 1e-14 * longest_squared)),
        duplicate_faces=len(faces) - len(distinct),
        components=_components(mesh),
    )


def _components(mesh: Mesh) -> int:
    edges, count = mesh.edges, len(mesh.vertices)
    graph = sparse.coo_array((np.ones(len(edges)), (edges[:, 0], edges[:, 1])), (count, count))
    _, labels = connected_components(graph, directed=False)
    return len(np.unique(labels[mesh.used_vertices]))
