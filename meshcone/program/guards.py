"""Rounds that mend: faces that pass through others or turn their backs on the reference.

The schedule ends with next to no smoothing, and here and there the mesh folds. Guard rounds
go on from its end. Around the faces that are amiss they smooth again, three times as hard in
each as in the one before; the rest is pulled on. The last of them holds every face that faces
the right way near there from turning over.

What a guard round does follows from where it starts and from which it is, so that its program
can be written again from a certificate.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from meshcone.program.cones import Orientation
from meshcone.program.prepared_reference import PreparedReference
from meshcone.program.source_structure import SourceStructure
from meshcone.program.surface_objective import SurfaceObjective
from meshcone.quality.intersections import self_intersections
from meshcone.surface import Mesh
from meshcone.surface.arrays import Bools, Floats, row_dot

_SMOOTHING, _GROWTH = 0.3, 3.0
# Of a sheet, or of faces stored twice, the closest face is as often the one on the other side.
_MANY = 0.2


@dataclass(frozen=True)
class Guard:
    """What is amiss where a guard round starts.

    Attributes:
        moving: the mesh there.
        directions: (m, 3) where each of its faces should face: the closest reference normal.
        amiss: (m,) faces that pass through others, or face the other way.
    """

    moving: Mesh
    directions: Floats
    amiss: Bools

    @staticmethod
    def of(
        moving: Mesh, reference: PreparedReference, structure: SourceStructure, most_pairs: int
    ) -> Guard:
        """Look for what is amiss.

        Args:
            moving: the mesh where the round starts.
            reference: the prepared reference.
            structure: of the source.
            most_pairs: pairs of faces that may be tested for passing through each other; where
                there are more, none does as far as this knows.
        """
        closest = reference.tree.closest(moving.corners.mean(axis=1))
        directions = structure.orientation * reference.tree.mesh.face_normals[closest.faces]
        amiss = (row_dot(moving.face_normals, directions) < 0) & (moving.face_areas > 0)
        if np.mean(amiss) > _MANY:
            amiss[:] = False
        crossing = self_intersections(moving, most_pairs)
        if crossing is not None:
            amiss[crossing.ravel()] = True
        return Guard(moving, directions, amiss)

    def smoothed(
        self, objective: SurfaceObjective, structure: SourceStructure, number: int
    ) -> SurfaceObjective:
        """Add fairness around what is amiss.

        It acts in proportion to the noisiness: smoothing melts a mesh whose edges are long.

        Args:
            objective: the round's, without a guard.
            structure: of the source.
            number: which guard round it is, counted from 0.
        """
        added = _SMOOTHING * _GROWTH**number * np.minimum(1, structure.noisiness)
        fairness = objective.fairness
        weights = fairness.weights + np.where(self._vertices, added, 0.0)
        return replace(objective, fairness=replace(fairness, weights=weights))

    def orientation(self) -> Orientation:
        """Hold the faces that touch a vertex of one that is amiss to the side they are on."""
        near = np.asarray(self._vertices[self.moving.faces].any(axis=1))
        return Orientation.at(self.moving, self.directions, near)

    @property
    def _vertices(self) -> Bools:
        found = np.zeros(len(self.moving.vertices), dtype=bool)
        found[self.moving.faces[self.amiss]] = True
        return found
