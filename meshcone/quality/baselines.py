"""What one would do without solving anything, to be measured beside the refined mesh."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from meshcone.surface import Mesh, SurfaceTree
from meshcone.surface.arrays import Floats

_STEPS, _STEP = 10, 0.5


def project(mesh: Mesh, reference: SurfaceTree) -> Mesh:
    """Put every vertex at its closest point of the reference."""
    return mesh.moved_to(reference.closest(mesh.vertices).points)


def smooth(mesh: Mesh) -> Mesh:
    """Take ten half steps of every vertex to the mean of its neighbours.

    The reference is not looked at; this is Laplacian smoothing with equal weights (Field,
    "Laplacian smoothing and Delaunay triangulations", 1988) at the strength trimesh and
    MeshLab begin with. A vertex without neighbours stays.
    """
    count, edges = len(mesh.vertices), mesh.edges
    ends = np.concatenate([edges, edges[:, ::-1]])
    neighbours = sparse.csr_array((np.ones(len(ends)), ends.T), shape=(count, count))
    valences = np.bincount(edges.ravel(), minlength=count)[:, None]
    positions: Floats = mesh.vertices
    for _ in range(_STEPS):
        means = neighbours @ positions / np.maximum(valences, 1)
        positions = np.where(valences > 0, positions + _STEP * (means - positions), positions)
    return mesh.moved_to(positions)
