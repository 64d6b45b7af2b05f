"""The surface formulation of one source and reference, ready to be written round by round."""

from __future__ import annotations

from dataclasses import dataclass

from meshcone.options import SurfaceOptions
from meshcone.program.cones import ConeFamily
from meshcone.program.correspondence import PreparedReference, SourceStructure, round_objective
from meshcone.program.request import RequestedCones
from meshcone.program.surface_objective import SurfaceObjective
from meshcone.surface import Mesh
from meshcone.surface.arrays import Floats


@dataclass(frozen=True)
class SurfaceProblem:
    """What all rounds share; a round's program follows from it and the round before.

    Attributes:
        source: the input in the frame.
        reference: the prepared reference.
        structure: what stays of the source.
        request: the cones.
        options: weights and schedule.
    """

    source: Mesh
    reference: PreparedReference
    structure: SourceStructure
    request: RequestedCones
    options: SurfaceOptions

    @property
    def rounds(self) -> int:
        """Number of rounds in the schedule."""
        return len(self.options.fairness)

    def program(
        self, round_index: int, before: Floats
    ) -> tuple[SurfaceObjective, list[ConeFamily]]:
        """Write a round's program.

        Args:
            round_index: counted from 0.
            before: (n, 3) where the previous round left the vertices.
        """
        moving = self.source.moved_to(before)
        objective = round_objective(
            round_index, moving, self.reference, self.structure, self.options
        )
        return objective, self.request.families(objective.forward)
