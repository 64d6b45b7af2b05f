"""Which reference point each vertex is pulled to, and which sample pulls at what.

Chosen anew between rounds from the positions of the round before. Everything here is
deterministic given the seed, so that a certificate's data can be rebuilt from the files.
"""

from __future__ import annotations

import numpy as np

from meshcone.options import SurfaceOptions
from meshcone.program.prepared_reference import PreparedReference
from meshcone.program.pulls import PlanePull, SurfacePoints
from meshcone.program.source_structure import SourceStructure
from meshcone.program.surface_objective import SurfaceObjective
from meshcone.program.trust import across_a_border
from meshcone.surface import Mesh, SurfaceTree
from meshcone.surface.arrays import row_dot
from meshcone.surface.closest import barycentric_weights

# A vertex whose normal opposes the closest face's belongs to the other side of a thin
# part: it counts for little rather than for nothing, which keeps the system definite.
_OPPOSED_WEIGHT = 0.02
# The first round still sees noisy normals: only clear opposition counts.
_FIRST_ROUND_OPPOSITION = -0.5
# Samples within this distance of the source pull at it whatever its median distance is.
_REACH_FLOOR = 0.02


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
    carried_along = structure.lost | (
        across_a_border(moving.vertices, closest, reference) & ~structure.border
    )
    weights = np.where(opposed, _OPPOSED_WEIGHT, 1.0)
    forward = PlanePull(
        weights=np.where(carried_along, 0.0, weights),
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
        fairness=structure.fairness(
            options.fairness[round_index], options.fairness_knee, carried_along, normals
        ),
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
    lost = structure.lost[moving.faces].all(axis=1).take(on_source.faces)
    counted = np.flatnonzero((facing > 0) & (on_source.distances < reach) & ~lost)
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
