"""The surface formulation of one source and reference, ready to be written round by round."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from meshcone.options import Options, SurfaceOptions
from meshcone.program.cones import ConeFamily
from meshcone.program.correspondence import round_objective
from meshcone.program.effort import Candidate
from meshcone.program.guards import Guard
from meshcone.program.held import HeldObjective
from meshcone.program.prepared_reference import PreparedReference
from meshcone.program.pulls import PlanePull
from meshcone.program.regions import Region, divide, region_count
from meshcone.program.request import RequestedCones, SourceLabels, resolve_cones
from meshcone.program.source_structure import SourceStructure
from meshcone.program.staying import Staying
from meshcone.program.surface_objective import SurfaceObjective
from meshcone.program.tied import TiedObjective
from meshcone.program.ties import Ties
from meshcone.surface import Mesh, without_copies
from meshcone.surface.arrays import Bools, Floats

RoundObjective = SurfaceObjective | HeldObjective | TiedObjective


@dataclass(frozen=True)
class SurfaceProblem:
    """What all rounds share; a round's program follows from it and the round before.

    Attributes:
        source: the input in the frame.
        reference: the prepared reference.
        structure: what stays of the source.
        request: the cones.
        options: weights and schedule.
        start: (n, 3) where the first round starts.
        most_pairs: pairs of faces that a guard round may test for passing through each other.
        regions: parts that are solved apart, if the mesh is divided.
        held: (n,) vertices that every round leaves where the input has them, or None for none.
        ties: which vertices follow an edge of another border, or None for none.
    """

    source: Mesh
    reference: PreparedReference
    structure: SourceStructure
    request: RequestedCones
    options: SurfaceOptions
    start: Floats
    most_pairs: int
    regions: tuple[Region, ...] = ()
    held: Bools | None = None
    ties: Ties | None = None

    def unmet(self) -> dict[str, int]:
        """Count the cones that the source itself does not satisfy, by what asked for them."""
        closest, kinds = self.structure.closest, Counter[str]()
        planes = PlanePull(
            weights=np.ones(len(closest.points)),
            normals=self.reference.tree.mesh.face_normals.take(closest.faces, axis=0),
            targets=closest.points,
            tangential=self.options.tangential,
        )
        for family in self.request.families(planes, self.source):
            kinds[family.kind] += family.unmet(self.source.vertices)
        return dict(+kinds)

    @property
    def rounds(self) -> int:
        """Number of rounds in the schedule."""
        return len(self.options.fairness)

    @property
    def guarded_rounds(self) -> int:
        """Number of rounds in the schedule and of guard rounds after it."""
        return self.rounds + self.options.guards

    @property
    def all_rounds(self) -> int:
        """Number of rounds there may be: after the guard rounds one that leaves places alone."""
        return self.guarded_rounds + 1

    def program(self, round_index: int, before: Floats) -> tuple[RoundObjective, list[ConeFamily]]:
        """Write a round's program.

        Args:
            round_index: counted from 0; those beyond the schedule are guard rounds, and the last
                holds every vertex that is where the input has it.
            before: (n, 3) where the previous round left the vertices.
        """
        whole, families = self._over_all(round_index, before)
        objective: RoundObjective = whole
        held = self.held
        if round_index == self.guarded_rounds:
            held = (before == self.source.vertices).all(axis=1)
        if held is not None and held.any():
            held = held if self.ties is None else self.ties.closed(held)
            objective = HeldObjective(whole, held, self.source.vertices)
        if self.ties is None:
            return objective, families
        return TiedObjective(objective, self.ties), [*families, self.ties.cones]

    def settled(self, positions: Floats) -> Floats:
        """Put what follows others exactly where it belongs at (n, 3) positions."""
        return positions if self.ties is None else self.ties.settled(positions)

    def _over_all(
        self, round_index: int, before: Floats
    ) -> tuple[SurfaceObjective, list[ConeFamily]]:
        moving = self.source.moved_to(before)
        objective = round_objective(
            round_index, moving, self.reference, self.structure, self.options
        )
        families = self.request.families(objective.forward, moving)
        if not self.rounds <= round_index < self.guarded_rounds:
            return objective, families
        guard = Guard.of(moving, self.reference, self.structure, self.most_pairs)
        objective = guard.smoothed(objective, self.structure, round_index - self.rounds)
        if round_index == self.guarded_rounds - 1:
            families = [*families, guard.orientation()]
        return objective, families


@dataclass
class SurfaceProblems:
    """The surface formulation of one pair, under every setting the effort allows.

    Attributes:
        source: in the reference's frame.
        reference: in its own frame.
        options: the caller's.
        radius: the frame's radius in model units, for lengths given in them.
        labels: regions and vertex numbering of the source file, for pins.
        start: (n, 3) where the first round starts, if not at the source.
        ties: which vertices of it follow an edge of another border, if any do.
        prepared: the reference, sampled once for all settings.
        staying: the side of it that the answer stays on, if one was asked for.
    """

    source: Mesh
    reference: Mesh
    options: Options
    radius: float = 1.0
    labels: SourceLabels | None = None
    start: Floats | None = None
    ties: Ties | None = None
    prepared: PreparedReference = field(init=False)
    staying: Staying | None = field(init=False)
    _structures: dict[float, SourceStructure] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        """Take faces that are stored twice once, and sample the reference."""
        self.source, kept = without_copies(self.source)
        self.reference, _ = without_copies(self.reference)
        if self.labels is not None and kept is not None:
            self.labels = replace(self.labels, regions=self.labels.regions[kept])
        count = len(self.source.vertices)
        self.prepared = PreparedReference.of(self.reference, count, self.options.seed)
        self.staying = Staying.of(self.prepared.tree, self.options.cones, self.radius)

    def problem(self, candidate: Candidate) -> SurfaceProblem:
        """Write the formulation under one setting."""
        chosen, source = candidate.options, self.source
        labels = self.labels or SourceLabels(
            np.zeros(len(source.faces), np.int64), np.arange(len(source.vertices))
        )
        return SurfaceProblem(
            source=source,
            reference=self.prepared,
            structure=self._structure(chosen.noise_scale),
            request=resolve_cones(
                source, chosen.edge_cap, self.options.cones, self.radius, labels, self.staying
            ),
            options=chosen,
            start=source.vertices if self.start is None else self.start,
            most_pairs=self.options.quality.intersection_pairs,
            regions=self.regions,
            held=~self._structure(chosen.noise_scale).mended if candidate.holding else None,
            ties=self.ties,
        )

    @cached_property
    def regions(self) -> tuple[Region, ...]:
        """The parts that are solved apart, if the mesh is to be divided."""
        count = region_count(self.options, len(self.source.vertices))
        if count == 1:
            return ()
        coupling = self._structure(self.options.surface.noise_scale).laplacian
        return divide(self.source.vertices, coupling, count)

    def _structure(self, noise_scale: float) -> SourceStructure:
        """Return what stays of the source, which most settings have in common."""
        if noise_scale not in self._structures:
            found = SourceStructure.of(self.source, self.prepared, noise_scale)
            self._structures[noise_scale] = found
        return self._structures[noise_scale]
