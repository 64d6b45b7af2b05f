"""The metrics once more, by other people's implementations; used by tests and benchmarks."""

from __future__ import annotations

from dataclasses import dataclass

import igl
import numpy as np
import point_cloud_utils
import pyvista
from scipy.sparse import csr_array
from scipy.sparse.csgraph import min_weight_full_bipartite_matching
from scipy.spatial.distance import cdist

from meshcone.quality.sampled import SampledSurface
from meshcone.surface import Mesh
from meshcone.surface.arrays import Floats


@dataclass(frozen=True)
class Independent:
    """Metrics that others compute too, from the same samples.

    Attributes:
        chamfer, chamfer_l1, hausdorff: by point-cloud-utils.
        point_to_surface_mean: by VTK's implicit distance.
        vertex_hausdorff: of the vertices to the other surface, by libigl.
        aspect_ratio: mean over the faces with area, by VTK.
    """

    chamfer: float
    chamfer_l1: float
    hausdorff: float
    point_to_surface_mean: float
    vertex_hausdorff: float
    aspect_ratio: float


def measure_independently(surface: SampledSurface, reference: SampledSurface) -> Independent:
    """Measure a pair by the other implementations."""
    here, there = surface.samples.points, reference.samples.points
    nearest, back = (
        point_cloud_utils.k_nearest_neighbors(*clouds, 1)[0]
        for clouds in ((here, there), (there, here))
    )
    meshes = surface.mesh, reference.mesh
    return Independent(
        chamfer=float(np.mean(nearest**2) + np.mean(back**2)),
        chamfer_l1=float(point_cloud_utils.chamfer_distance(here, there)),
        hausdorff=float(point_cloud_utils.hausdorff_distance(here, there)),
        point_to_surface_mean=float(
            (_distances(here, meshes[1]).mean() + _distances(there, meshes[0]).mean()) / 2
        ),
        vertex_hausdorff=float(
            igl.hausdorff(meshes[0].vertices, meshes[0].faces, meshes[1].vertices, meshes[1].faces)
        ),
        aspect_ratio=aspect_ratio_by_vtk(meshes[0]),
    )


def _distances(points: Floats, mesh: Mesh) -> Floats:
    target = pyvista.PolyData.from_regular_faces(mesh.vertices, mesh.faces)
    found = pyvista.PolyData(points).compute_implicit_distance(target)
    return np.abs(np.asarray(found["implicit_distance"], dtype=np.float64))


def aspect_ratio_by_vtk(mesh: Mesh) -> float:
    """Mean aspect ratio of the faces with area, by VTK."""
    solid = mesh.face_areas > 1e-14 * mesh.corners.var(axis=1).max(axis=1)
    grid = pyvista.PolyData.from_regular_faces(mesh.vertices, mesh.faces[solid])
    return float(np.mean(grid.cell_quality("aspect_ratio")["aspect_ratio"]))


def earth_movers_distance(points: Floats, others: Floats) -> float:
    """Earth mover's distance of two clouds of k points each, by scipy's sparse matching.

    That is another algorithm than the dense assignment the metric uses. The function of this
    name in point-cloud-utils is Sinkhorn's approximation.
    """
    costs = cdist(points, others)
    rows, columns = min_weight_full_bipartite_matching(csr_array(costs))
    return float(costs[rows, columns].mean())
