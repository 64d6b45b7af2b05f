"""A surface with the points its metrics are taken from."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import KDTree

from meshcone.quality.closest_normals import ClosestNormals
from meshcone.quality.curvature import CurvatureField
from meshcone.quality.edge_uses import EdgeUses
from meshcone.surface import ClosestPoints, Frame, Mesh, SurfaceSamples, SurfaceTree, sample_surface
from meshcone.surface.arrays import Floats, Ints, row_lengths
from meshcone.surface.ordering import spatial_order
from meshcone.surface.sampling import SamplingMethod

# Sides that agree to so many digits of the longest of all are equally long.
_DIGITS = 9


@dataclass(frozen=True)
class Sampling:
    """How surfaces are sampled.

    Attributes:
        samples: for distances and normals, per surface.
        emd_samples: for the earth mover's distance, per surface.
        curvature_samples: of those, for the curvature error, per surface; no more than them.
        method: how points are drawn.
    """

    samples: int
    emd_samples: int
    curvature_samples: int
    method: SamplingMethod = "sobol"


class SampledSurface:
    """A mesh, its closest points and its samples.

    The samples depend on the surface, its triangles and the seed, but not on the order in
    which the file lists vertices, faces or corners, nor on where the mesh lies; see
    :func:`in_own_order`.
    """

    def __init__(self, mesh: Mesh, sampling: Sampling, seed: int) -> None:
        """Sample a mesh of positive area.

        Args:
            mesh: the surface.
            sampling: how many points, and how they are drawn.
            seed: the same seed gives the same samples.
        """
        self.mesh = mesh
        self._sampling = sampling
        self._own_curvatures: dict[float, Floats] = {}
        self._closest: dict[SampledSurface, ClosestPoints] = {}
        drawn = max(sampling.samples, sampling.emd_samples)
        ordered, numbers = in_own_order(mesh)
        found = sample_surface(ordered, drawn, seed, sampling.method)
        self._drawn = SurfaceSamples(found.points, found.normals, numbers[found.faces])

    @cached_property
    def samples(self) -> SurfaceSamples:
        """Samples for distances and normals."""
        return self._first(self._sampling.samples)

    @cached_property
    def matching(self) -> Floats:
        """Points for the earth mover's distance, (k, 3)."""
        return self._first(self._sampling.emd_samples).points

    @cached_property
    def curvature_points(self) -> SurfaceSamples:
        """Samples for the curvature error, the first of the others."""
        return self._first(self._sampling.curvature_samples)

    @cached_property
    def points(self) -> Floats:
        """All points that look for the other surface, (k, 3): the samples, then the vertices.

        Vertices no face uses are left out.
        """
        mesh = self.mesh
        return np.concatenate([self.samples.points, mesh.vertices[mesh.used_vertices]])

    def closest_on(self, target: SampledSurface, first: int | None = None) -> ClosestPoints:
        """Find the closest points of another surface; the search is done once.

        Args:
            target: the other surface.
            first: answer for as many of the points only.
        """
        if target not in self._closest:
            own = self.mesh.equals(target.mesh)
            self._closest[target] = self._on_itself if own else target.tree.closest(self.points)
        found = self._closest[target]
        return ClosestPoints(found.distances[:first], found.faces[:first], found.points[:first])

    @property
    def _on_itself(self) -> ClosestPoints:
        faces = np.empty(len(self.mesh.vertices), dtype=np.int64)
        faces[self.mesh.faces[::-1].ravel()] = np.repeat(np.arange(len(self.mesh.faces))[::-1], 3)
        faces = np.concatenate([self.samples.faces, faces[self.mesh.used_vertices]])
        return ClosestPoints(np.zeros(len(faces)), faces, self.points)

    @cached_property
    def tree(self) -> SurfaceTree:
        """Closest points on the triangles."""
        return SurfaceTree(self.mesh)

    @cached_property
    def sample_tree(self) -> KDTree:
        """Nearest samples."""
        return KDTree(self.samples.points)

    @cached_property
    def curvature(self) -> CurvatureField:
        """Mean curvature over balls."""
        return CurvatureField(self._edge_uses)

    @cached_property
    def closest_normals(self) -> ClosestNormals:
        """Normals of the triangles closest points lie on."""
        return ClosestNormals(self._edge_uses)

    @cached_property
    def _edge_uses(self) -> EdgeUses:
        return EdgeUses.of(self.mesh)

    @cached_property
    def radius(self) -> float:
        """Radius of the sphere the mesh would be scaled by; 1 for a reference in its frame."""
        return Frame.of(self.mesh).radius

    def let_go(self) -> None:
        """Keep nothing that only comparing it takes; what is asked for again is made again.

        Of a mesh of a million vertices that is more than a gigabyte.
        """
        for name in ("curvature", "closest_normals", "_edge_uses", "sample_tree"):
            self.__dict__.pop(name, None)

    def own_curvatures(self, radius: float) -> Floats:
        """Mean curvature at its own points, over balls of a radius in the mesh's unit."""
        if radius not in self._own_curvatures:
            points = self.curvature_points.points
            self._own_curvatures[radius] = self.curvature.at(points, radius)
        return self._own_curvatures[radius]

    def _first(self, count: int) -> SurfaceSamples:
        # A prefix of either kind of sequence is what a draw of that many would have been.
        drawn = self._drawn
        return SurfaceSamples(drawn.points[:count], drawn.normals[:count], drawn.faces[:count])


def in_own_order(mesh: Mesh) -> tuple[Mesh, Ints]:
    """Return the mesh with its faces in an order that only its shape decides, and their numbers.

    Samples are drawn along the list of faces: in the file's order, a tool that lists the
    same triangles differently would change every metric a little. Here faces follow a
    space-filling curve in the frame of the surface's principal axes, and begin at the corner
    opposite their longest side; none of that changes when the mesh is moved or scaled. Along
    such a curve a low-discrepancy sequence is even in space as well: it takes a third off the
    floor of the earth mover's distance. Where a symmetric shape has no principal axes, they
    follow from the file's order after all.
    """
    areas, faces = mesh.face_areas, mesh.faces
    a, b, c = (mesh.vertices.take(corner, axis=0) for corner in faces.T)
    offsets = (a + b + c) / 3
    offsets -= areas @ offsets / areas.sum()
    _, axes = np.linalg.eigh((offsets * areas[:, None]).T @ offsets)
    along = offsets @ axes
    along *= np.where(areas @ along**3 < 0, -1.0, 1.0)  # an axis points to its longer tail
    sides = np.stack([row_lengths(side) for side in (c - b, a - c, b - a)], axis=1)
    longest = np.round(sides / max(float(sides.max()), 1e-300), _DIGITS)
    first = np.argmax(longest, axis=1)[:, None]
    turned: Ints = np.take_along_axis(faces, (first + np.arange(3)) % 3, axis=1)
    order = spatial_order(along)
    return Mesh(mesh.vertices, turned[order]), order
