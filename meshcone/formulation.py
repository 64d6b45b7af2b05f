"""A pair of meshes under the formulation the options choose, written but not solved."""

from __future__ import annotations

import abc

import numpy as np

from meshcone.errors import InputError
from meshcone.options import Options
from meshcone.pair import Pair
from meshcone.program.answer import FinalProgram
from meshcone.program.centroid import centroid_program
from meshcone.program.certificate import MultiplierTable, attach_multipliers
from meshcone.program.effort import candidates
from meshcone.program.request import SourceLabels
from meshcone.program.seams import Seams
from meshcone.program.surface_problem import SurfaceProblem, SurfaceProblems
from meshcone.surface.arrays import Floats
from meshcone.vertex_list import listed_vertices


class Formulated(abc.ABC):
    """A formulation of one pair."""

    @abc.abstractmethod
    def rebuild(
        self,
        candidate: str,
        round_index: int,
        before: Floats,
        positions: Floats,
        multipliers: MultiplierTable,
    ) -> FinalProgram:
        """Write a round's program from what a certificate holds, without solving anything.

        Raises:
            InputError: there is no such setting, round, or cone.
        """

    def unmet(self) -> dict[str, int]:
        """Count the cones that the source itself does not satisfy, by kind; here there are none."""
        return {}

    @property
    def magnification(self) -> float:
        """Length in the frame of a unit of the program's own variable."""
        return 1.0

    def into_program(self, positions: Floats) -> Floats:
        """Map answers (n, 3) in the frame to the program's own variable."""
        return positions

    def out_of_program(self, optimum: Floats) -> Floats:
        """Map an optimum to the answer (n, 3) in the frame it stands for."""
        return optimum

    def settled(self, answer: Floats) -> Floats:
        """Put what a solver leaves near where it belongs exactly there, (n, 3)."""
        return answer

    def started_at(self, before: Floats) -> Floats:
        """Map where a round started to vertices of the source, (n, 3) in the frame."""
        return before

    def of_vertices(self, values: Floats) -> Floats:
        """Map a value of each vertex of the program to one of each vertex of the source, (n,)."""
        return values

    def in_source(self, index: int) -> int:
        """Return a vertex of the source that a vertex of the program stands for."""
        return index


class SurfaceFormulation(Formulated):
    """The surface program of one pair.

    Attributes:
        seams: which vertices of the source are one vertex of the program.
        problems: the program under every setting that is tried.
    """

    def __init__(self, pair: Pair, options: Options, start: Floats | None = None) -> None:
        asset = pair.source_asset
        self.seams = Seams.of(pair.source)
        listed = listed_vertices(options, pair.source_file.resources, len(asset.weld))
        weld = np.where(asset.weld >= 0, self.seams.group[asset.weld], -1)
        fixed = np.zeros(len(self.seams.first), dtype=bool)
        fixed[self.seams.group[pair.fixed]] = True
        labels = SourceLabels(asset.regions, weld, fixed, listed)
        self.problems = SurfaceProblems(
            self.seams.joined,
            pair.reference,
            options,
            pair.frame.radius,
            labels,
            None if start is None else self.into_program(start),
            ties=self.seams.ties,
        )

    def unmet(self) -> dict[str, int]:
        """See :meth:`Formulated.unmet`."""
        return self._problem.unmet()

    @property
    def _problem(self) -> SurfaceProblem:
        """The program under one of its settings; what cones hold is the same in all."""
        return self.problems.problem(candidates(self.problems.options)[0])

    def into_program(self, positions: Floats) -> Floats:
        """See :meth:`Formulated.into_program`."""
        return self.seams.gathered(positions)

    def out_of_program(self, optimum: Floats) -> Floats:
        """See :meth:`Formulated.out_of_program`."""
        return self.seams.spread(optimum)

    def settled(self, answer: Floats) -> Floats:
        """See :meth:`Formulated.settled`."""
        settled = self.seams.settled(self.seams.gathered(answer))
        pinned = self._problem.request.pinned(settled)
        return self.seams.spread(pinned)

    def started_at(self, before: Floats) -> Floats:
        """See :meth:`Formulated.started_at`."""
        return self.seams.spread(before)

    def of_vertices(self, values: Floats) -> Floats:
        """See :meth:`Formulated.of_vertices`."""
        return np.asarray(values[self.seams.group])

    def in_source(self, index: int) -> int:
        """See :meth:`Formulated.in_source`."""
        return int(self.seams.first[index])

    def rebuild(
        self,
        candidate: str,
        round_index: int,
        before: Floats,
        positions: Floats,
        multipliers: MultiplierTable,
    ) -> FinalProgram:
        """See :meth:`Formulated.rebuild`."""
        named = {tried.name: tried for tried in candidates(self.problems.options)}
        if candidate not in named:
            raise InputError(f"the options know no setting '{candidate}'")
        problem = self.problems.problem(named[candidate])
        if round_index >= problem.all_rounds:
            raise InputError(f"the setting '{candidate}' has {problem.all_rounds} rounds")
        objective, families = problem.program(round_index, before)
        attached = attach_multipliers(families, multipliers)
        return FinalProgram(round_index, before, objective, families, positions, attached)


class CentroidFormulation(Formulated):
    """The paper's program of one pair.

    Attributes:
        pair: the pair.
        options: the caller's.
    """

    def __init__(self, pair: Pair, options: Options) -> None:
        if pair.fixed.any():
            raise InputError("option 'select' needs the surface formulation: no vertex stays here")
        self.pair, self.options = pair, options
        self._objective, self._caps, _ = centroid_program(pair.source, pair.reference, options)

    def rebuild(
        self,
        candidate: str,
        round_index: int,
        before: Floats,
        positions: Floats,
        multipliers: MultiplierTable,
    ) -> FinalProgram:
        """See :meth:`Formulated.rebuild`."""
        if candidate != "as set" or round_index != 0:
            raise InputError("the centroid formulation has one setting and one round")
        if not np.array_equal(before, self.pair.source.vertices):
            raise InputError("the centroid formulation starts at the source")
        attached = attach_multipliers([self._caps], multipliers)
        return FinalProgram(0, before, self._objective, [self._caps], positions, attached)

    @property
    def magnification(self) -> float:
        """See :attr:`Formulated.magnification`."""
        return self._objective.undo_scale

    def into_program(self, positions: Floats) -> Floats:
        """Shrink positions about the centroid again."""
        centroid = self._objective.centroid
        return centroid + (positions - centroid) / self.magnification

    def out_of_program(self, optimum: Floats) -> Floats:
        """Undo the shrink."""
        return self._objective.undo_shrink(optimum)


def formulate(pair: Pair, options: Options) -> SurfaceFormulation | CentroidFormulation:
    """Put a pair under the formulation its options choose."""
    if options.formulation == "centroid":
        return CentroidFormulation(pair, options)
    return SurfaceFormulation(pair, options)
