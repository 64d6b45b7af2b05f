"""Which reference point each vertex is pulled to, and which sample pulls at what.

Chosen anew between rounds from the positions of the round before. Everything here is
deterministic given the seed, so that a certificate's data can be rebuilt from the files.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from meshcone.options import SurfaceOptions
from meshcone.program.pulls import PlanePull, SurfacePoints
from meshcone.program.surface_objective import SurfaceObjective
from meshcone.surface import ClosestPoints, Mesh, SurfaceTree, sample_surface
from meshcone.surface.arrays import Floats, row_dot
from meshcone.surface.closest import barycentric_weights
from meshcone.surface.ordering import spatial_order

# A vertex whose normal opposes the closest face's belongs to the other side of a thin
# part: it counts for little rather than for nothing, which keeps the system definite.
_OPPOSED_WEIGHT = 0.02
# The first round still sees noisy normals: only clear opposition counts.
_FIRST_ROUND_OPPOSITION = -0.5
# Samples within this distance of the source pull at it whatever its median distance is.
_REACH_FLOOR = 0.02
_FAIRNESS_FLOOR = 1e-4
# Samples of the reference: about as many again as the source has vertices while that is
# cheap, and fewer for dense meshes, whose edges are shorter than what is left to find.
_FEWEST_SAMPLES = 2000
_DENSE_FROM = 40_000


@dataclass(frozen=True)
class PreparedReference:
    """The reference with what every round asks of it.

    Attributes:
        tree: closest points on it.
        points: (k, 3) samples of it: on its faces and at its vertices.
        normals: (k, 3) their normals.
    """

    tree: SurfaceTree
    points: Floats
    normals: Floats

    @staticmethod
    def of(reference: Mesh, source_vertices: int, seed: int) -> PreparedReference:
        """Sample the reference up to twice as densely as the source has vertices.

        Its own vertices are among the samples: they are where corners are.
        """
        count = min(2 * source_vertices, _DENSE_FROM + source_vertices // 4)
        count = max(count, _FEWEST_SAMPLES)
        samples = sample_surface(reference, count, seed)
        chosen = reference.used_vertices
        if len(chosen) > count:
            chosen = np.random.default_rng(seed).choice(chosen, count, replace=False)
        points = np.concatenate([samples.points, reference.vertices[chosen]])
        normals = np.concatenate([samples.normals, reference.vertex_normals[chosen]])
        order = spatial_order(points)
        return PreparedReference(SurfaceTree(reference), points[order], normals[order])


@dataclass(frozen=True)
class SourceStructure:
    """What stays of the source through all rounds.

    Attributes:
        laplacian: (n, n) uniform Laplacian: each vertex minus the mean of its neighbours.
        orientation: 1, or −1 where the source is inside out against the reference.
        noisiness: (n,) squared ratio of the distance of each vertex's neighbourhood from
            the reference to the length of its edges: above 1, edges say nothing of the shape.
        vertices: (n, 3) the input.
        closest: the reference's closest points to it.
    """

    laplacian: sparse.csr_array
    orientation: float
    noisiness: Floats
    vertices: Floats
    closest: ClosestPoints

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
        nearby = (adjacency @ closest.distances + closest.distances) / (degree + 1)
        scale = np.maximum(noise_scale * lengths / degree, 1e-12)
        return SourceStructure(
            laplacian=_laplacian(adjacency),
            orientation=1.0 if agreement.mean() >= 0 else -1.0,
            noisiness=(nearby / scale) ** 2,
            vertices=source.vertices,
            closest=closest,
        )

    def closest_points(self, moving: Mesh, reference: PreparedReference) -> ClosestPoints:
        """Find the reference's closest points to a round's starting positions."""
        if moving.vertices is self.vertices:
            return self.closest
        return reference.tree.closest(moving.vertices)

    def fairness(self, weight: float, knee: float) -> Floats:
        """Return the fairness of each vertex, (n,), for a round's weight.

        It acts in proportion to the noisiness, up to the weight. A weight above the knee
        smooths a dense noisy mesh enough to unfold it and would melt a coarse one, so it is
        reached only where the noisiness is as much above 1.
        """
        share = np.minimum(1, self.noisiness * min(1, knee / weight)) if weight > 0 else 0.0
        return np.asarray(weight * (share + _FAIRNESS_FLOOR) + np.zeros_like(self.noisiness))


def _laplacian(adjacency: sparse.csr_array) -> sparse.csr_array:
    """Return the uniform Laplacian (n, n); the row of an isolated vertex is zero."""
    degree = np.diff(adjacency.indptr)
    connected = (degree > 0).astype(np.float64)
    mean = sparse.diags_array(connected / np.maximum(degree, 1)) @ adjacency
    return sparse.csr_array(sparse.diags_array(connected) - mean)


def round_objective(
    round_index: int,
    moving: Mesh,
    reference: PreparedReference,
    structure: SourceStructure,
    options: SurfaceOptions,
) -> SurfaceObjective:
    """Build a round's objective from the positions of the round before.

    Args:
        round_index: counted from 0. By default the first round uses no reverse term: the
            input is too rough for samples of the reference to know where on it they belong.
        moving: the source where the previous round left it, in the reference's frame.
        reference: the prepared reference.
        structure: what stays of the source.
        options: weights and schedule.
    """
    closest = structure.closest_points(moving, reference)
    normals = reference.tree.mesh.face_normals.take(closest.faces, axis=0)
    agreement = structure.orientation * row_dot(moving.vertex_normals, normals)
    opposed = agreement < (_FIRST_ROUND_OPPOSITION if round_index == 0 else 0)
    forward = PlanePull(
        weights=np.where(opposed, _OPPOSED_WEIGHT, 1.0),
        normals=normals,
        targets=closest.points,
        tangential=options.tangential,
    )
    backward: PlanePull | None = None
    carried: SurfacePoints | None = None
    if round_index >= options.reverse_from and options.reverse > 0:
        reach = options.reach * float(np.median(closest.distances)) + _REACH_FLOOR
        backward, carried = _reverse_term(moving, reference, structure, options, reach)
    return SurfaceObjective(
        forward=forward,
        backward=backward,
        carried=carried,
        previous=moving.vertices,
        proximity=options.proximity,
        laplacian=structure.laplacian,
        fairness=structure.fairness(options.fairness[round_index], options.fairness_knee),
    )


def _reverse_term(
    moving: Mesh,
    reference: PreparedReference,
    structure: SourceStructure,
    options: SurfaceOptions,
    reach: float,
) -> tuple[PlanePull, SurfacePoints]:
    on_source = SurfaceTree(moving).closest(reference.points)
    facing = structure.orientation * row_dot(
        moving.face_normals.take(on_source.faces, axis=0), reference.normals
    )
    counted = np.flatnonzero((facing > 0) & (on_source.distances < reach))
    faces = on_source.faces.take(counted)
    weight = options.reverse * len(moving.vertices) / len(reference.points)
    pull = PlanePull(
        weights=np.full(len(counted), weight),
        normals=reference.normals.take(counted, axis=0),
        targets=reference.points.take(counted, axis=0),
        tangential=options.tangential,
    )
    carried = SurfacePoints(
        corners=moving.faces.take(faces, axis=0),
        weights=barycentric_weights(on_source.points.take(counted, axis=0), moving, faces),
        vertex_count=len(moving.vertices),
    )
    return pull, carried
