"""Which reference point each vertex is pulled to, and which sample pulls at what.

Chosen anew between rounds from the positions of the round before. Everything here is
deterministic given the seed, so that a certificate's data can be rebuilt from the files.
"""

from __future__ import annotations

import numpy as np

from meshcone.options import SurfaceOptions
from meshcone.program.prepared_reference import PreparedReference, sample_count
from meshcone.program.pulls import PlanePull, SurfacePoints
from meshcone.program.source_structure import SourceStructure
from meshcone.program.surface_objective import SurfaceObjective
from meshcone.program.trust import across_a_border, median_where
from meshcone.surface import ClosestPoints, Mesh, SurfaceTree, sample_surface
from meshcone.surface.arrays import Bools, row_dot
from meshcone.surface.closest import barycentric_weights

# A vertex whose normal opposes the closest face's belongs to the other side of a thin
# part: it counts for little rather than for nothing, which keeps the system definite.
_OPPOSED_WEIGHT = 0.02
# The first round still sees noisy normals: only clear opposition counts.
_FIRST_ROUND_OPPOSITION = -0.5
# Samples within this distance of the source pull at it whatever its median distance is.
_REACH_FLOOR = 0.02
# A sample this far across an open border of the source lies on what the source lacks. Nearer ones
# bring out the borders of coarse meshes.
_LACKING_IN_MEDIANS, _LACKING_FLOOR = 3.0, 0.1
# A sample farther than both from the foot of a part that the reference lacks lies under the part.
_UNDER_IN_MEDIANS, _UNDER_IN_EDGES = 3.0, 0.15


def round_objective(
    round_index: int,
    moving: Mesh,
    reference: PreparedReference,
    structure: SourceStructure,
    options: SurfaceOptions,
) -> SurfaceObjective:
    """Build a round's objective from the positions of the round before.

    Args:
        round_index: counted from 0; beyond the schedule its last fairness holds. By default the
            first round uses no reverse term: the input is too rough for samples of the reference
            to know where on it they belong.
        moving: the source where the previous round left it, in the reference's frame.
        reference: the prepared reference.
        structure: what stays of the source.
        options: weights and schedule.
    """
    closest = structure.closest_points(moving, reference)
    normals = reference.tree.mesh.face_normals.take(closest.faces, axis=0)
    agreement = structure.orientation * row_dot(moving.vertex_normals, normals)
    opposed = agreement < (_FIRST_ROUND_OPPOSITION if round_index == 0 else 0)
    carried_along = structure.lost | (
        across_a_border(moving.vertices, closest, reference.tree.mesh) & ~structure.border
    )
    weights = np.where(opposed, _OPPOSED_WEIGHT, 1.0)
    forward = PlanePull(
        weights=np.where(carried_along, 0.0, weights),
        normals=normals,
        targets=closest.points,
        tangential=options.tangential,
    )
    pulls: list[_Pull] = []
    faces = options.faces if round_index >= options.faces_from else 0.0
    reverse = faces or options.reverse
    if round_index >= options.reverse_from and reverse > 0:
        median = median_where(closest.distances, ~carried_along)
        pulls.append(_reverse_term(moving, reference, structure, options, median, reverse))
    if faces > 0 and moving.face_areas.sum() > 0:
        seed = reference.seed + round_index
        pulls.append(_face_term(moving, reference, structure, options, carried_along, seed))
    backward, carried = _together(pulls)
    weight = options.fairness[min(round_index, len(options.fairness) - 1)]
    return SurfaceObjective(
        forward=forward,
        backward=backward,
        carried=carried,
        previous=moving.vertices,
        proximity=options.proximity,
        fairness=structure.fairness(weight, options.fairness_knee, carried_along, normals),
    )


_Pull = tuple[PlanePull, SurfacePoints]


def _together(pulls: list[_Pull]) -> _Pull | tuple[None, None]:
    """Join pulls at points that the same mesh carries."""
    if not pulls:
        return None, None
    (pull, points), *others = pulls
    for more, places in others:
        pull = PlanePull(
            weights=np.concatenate([pull.weights, more.weights]),
            normals=np.concatenate([pull.normals, more.normals]),
            targets=np.concatenate([pull.targets, more.targets]),
            tangential=pull.tangential,
        )
        points = SurfacePoints(
            corners=np.concatenate([points.corners, places.corners]),
            weights=np.concatenate([points.weights, places.weights]),
            vertex_count=points.vertex_count,
        )
    return pull, points


def _face_term(
    moving: Mesh,
    reference: PreparedReference,
    structure: SourceStructure,
    options: SurfaceOptions,
    carried_along: Bools,
    seed: int,
) -> _Pull:
    """Pull samples of the moving faces to the reference: what a distance is measured on.

    Vertices on a curved surface leave the faces between them inside of it.
    """
    count = sample_count(len(moving.vertices))
    samples = sample_surface(moving, count, seed).in_space()
    corners = moving.faces.take(samples.faces, axis=0)
    closest = reference.tree.closest(samples.points)
    normals = reference.tree.mesh.face_normals.take(closest.faces, axis=0)
    agreement = structure.orientation * row_dot(samples.normals, normals)
    astray = carried_along[corners].any(axis=1)
    astray |= across_a_border(samples.points, closest, reference.tree.mesh)
    weights = np.where(astray, 0.0, np.where(agreement < 0, _OPPOSED_WEIGHT, 1.0))
    pull = PlanePull(
        weights=options.faces * len(moving.vertices) / count * weights,
        normals=normals,
        targets=closest.points,
        tangential=options.tangential,
    )
    shares = barycentric_weights(samples.points, moving, samples.faces)
    return pull, SurfacePoints(corners, shares, len(moving.vertices))


def _reverse_term(
    moving: Mesh,
    reference: PreparedReference,
    structure: SourceStructure,
    options: SurfaceOptions,
    median: float,
    strength: float,
) -> _Pull:
    """Pull at the mesh from samples of the reference, but for those it has nothing near.

    What lies across an open border of the mesh is what the mesh lacks. Refining adds no surface,
    and would only spread what there is.
    """
    reach = options.reach * median + _REACH_FLOOR
    on_source = SurfaceTree(moving).closest(reference.points)
    facing = structure.orientation * row_dot(
        moving.face_normals.take(on_source.faces, axis=0), reference.normals
    )
    lost = _without_place(moving, structure.lost, on_source, median)
    lacking = across_a_border(
        reference.points, on_source, moving, _LACKING_IN_MEDIANS * median + _LACKING_FLOOR
    )
    counted = np.flatnonzero((facing > 0) & (on_source.distances < reach) & ~lost & ~lacking)
    faces = on_source.faces.take(counted)
    weight = strength * len(moving.vertices) / len(reference.points)
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


def _without_place(moving: Mesh, lost: Bools, on_source: ClosestPoints, median: float) -> Bools:
    """Find the samples that lie under a part which the reference lacks, (k,).

    Where the part stands on the rest, the source has no surface: the samples there are closest to
    the part itself or to its foot, which they would pull together.
    """
    faces = moving.faces
    foot = np.zeros(len(lost), dtype=bool)
    foot[faces[lost[faces].any(axis=1)]] = True
    beside = foot[faces].any(axis=1).take(on_source.faces)
    near = max(_UNDER_IN_MEDIANS * median, _UNDER_IN_EDGES * float(np.mean(moving.edge_lengths)))
    beside &= on_source.distances > near
    return np.asarray(beside | lost[faces].all(axis=1).take(on_source.faces))
