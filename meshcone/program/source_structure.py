"""What stays of the source through all rounds: its edges, its borders, and how rough it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from meshcone.program.fairness import Fairness
from meshcone.program.prepared_reference import PreparedReference
from meshcone.program.trust import across_a_border, without_counterpart
from meshcone.quality.facing import orientation_of
from meshcone.surface import ClosestPoints, Mesh
from meshcone.surface.arrays import Bools, Floats, Ints, row_dot

_FAIRNESS_FLOOR = 1e-4
# Of the radius: what single precision and six decimals make of a vertex on the reference.
_EXACT = 1e-6
# Fairness of displacements: where a vertex is carried by its neighbours, and within the
# tangent plane of borders, which no smoothing may shorten.
_CARRYING, _OUTLINE = 1.0, 0.3


@dataclass(frozen=True)
class SourceStructure:
    """What stays of the source through all rounds.

    Attributes:
        laplacian: (n, n) uniform Laplacian: each vertex minus the mean of its neighbours.
        orientation: 1, or −1 where the source is inside out against the reference.
        noisiness: (n,) squared ratio of the distance of each vertex's neighbourhood from
            the reference to the length of its edges: above 1, edges say nothing of the shape.
        border: (n,) whether a vertex lies on an open border.
        lost: (n,) whether a vertex belongs to a part the reference lacks.
        pieces: (n,) number of the connected piece that a vertex belongs to.
        vertices: (n, 3) the input.
        closest: the reference's closest points to it.
    """

    laplacian: sparse.csr_array
    orientation: float
    noisiness: Floats
    border: Bools
    lost: Bools
    pieces: Ints
    vertices: Floats
    closest: ClosestPoints

    @property
    def exact(self) -> Bools:
        """(n,) whether a vertex of the input lies on the reference."""
        return self.closest.distances <= _EXACT

    @property
    def mended(self) -> Bools:
        """(n,) which vertices move where those stay that lie on the reference.

        A piece without such a vertex stays as well: smoothed and held nowhere, it would fall to a
        point.
        """
        anchored = np.bincount(self.pieces, self.exact) > 0
        return ~self.exact & anchored[self.pieces]

    @staticmethod
    def of(source: Mesh, reference: PreparedReference, noise_scale: float) -> SourceStructure:
        """Measure the input against the reference.

        Args:
            source: the input in the frame.
            reference: the prepared reference.
            noise_scale: distance over edge length at which the noisiness is 1.
        """
        count, edges = len(source.vertices), source.edges
        degree = np.maximum(np.bincount(edges.ravel(), minlength=count), 1)
        ends = np.concatenate([edges, edges[:, ::-1]]).astype(np.int32)
        adjacency = sparse.coo_array(
            (np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(count, count)
        ).tocsr()
        lengths = np.bincount(edges.ravel(), np.repeat(source.edge_lengths, 2), minlength=count)
        closest = reference.tree.closest(source.vertices)
        normals = reference.tree.mesh.face_normals[closest.faces]
        agreement = row_dot(source.vertex_normals, normals)
        pieces: Ints = connected_components(adjacency, directed=False)[1].astype(np.int64)
        lost = without_counterpart(source, adjacency, pieces, closest.distances, reference)
        # How far what the reference lacks is from it says nothing of noise.
        across = across_a_border(source.vertices, closest, reference.tree.mesh)
        lacking = lost | (across & (2 * (adjacency @ across.astype(np.float64)) >= degree))
        near = np.where(lacking, 0.0, closest.distances)
        nearby = (adjacency @ near + near) / (degree + 1)
        scale = np.maximum(noise_scale * lengths / degree, 1e-12)
        return SourceStructure(
            laplacian=_laplacian(adjacency),
            orientation=orientation_of(source, reference.tree.mesh, float(agreement.mean())),
            noisiness=(nearby / scale) ** 2,
            border=source.border_vertices,
            lost=lost,
            pieces=pieces,
            vertices=source.vertices,
            closest=closest,
        )

    def closest_points(self, moving: Mesh, reference: PreparedReference) -> ClosestPoints:
        """Find the reference's closest points to a round's starting positions."""
        if moving.vertices is self.vertices:
            return self.closest
        return reference.tree.closest(moving.vertices)

    def fairness(self, weight: float, knee: float, carried: Bools, normals: Floats) -> Fairness:
        """Return the fairness for a round's weight.

        It acts in proportion to the noisiness, up to the weight. A weight above the knee
        smooths a dense noisy mesh enough to unfold it and would melt a coarse one, so it is
        reached only where the noisiness is as much above 1.

        Args:
            weight: the round's.
            knee: see above.
            carried: (n,) vertices that move with their neighbours.
            normals: (n, 3) of the reference at the closest points.
        """
        share = np.minimum(1, self.noisiness * min(1, knee / weight)) if weight > 0 else 0.0
        smoothing = weight * (share + _FAIRNESS_FLOOR) + np.zeros_like(self.noisiness)
        within = self.border & ~carried
        rest = np.where((carried | within)[:, None], self._shape, 0.0)
        rest -= np.where(within, row_dot(rest, normals), 0.0)[:, None] * normals
        return Fairness(
            laplacian=self.laplacian,
            weights=np.where(carried, _CARRYING, smoothing),
            outline=np.where(within, _OUTLINE, 0.0),
            normals=normals,
            rest=rest,
        )

    @property
    def _shape(self) -> Floats:
        return np.asarray(self.laplacian @ self.vertices)


def _laplacian(adjacency: sparse.csr_array) -> sparse.csr_array:
    """Return the uniform Laplacian (n, n); the row of an isolated vertex is zero."""
    degree = np.diff(adjacency.indptr)
    connected = (degree > 0).astype(np.float64)
    mean = sparse.diags_array(connected / np.maximum(degree, 1)) @ adjacency
    return sparse.csr_array(sparse.diags_array(connected) - mean)
