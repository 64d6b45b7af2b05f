"""A pair of meshes under the formulation the options choose: to be solved or rebuilt."""

from __future__ import annotations

import abc

import numpy as np

from meshcone.errors import InputError
from meshcone.options import Options
from meshcone.pair import Pair
from meshcone.program.answer import FinalProgram, RefinedPositions
from meshcone.program.certificate import MultiplierTable, attach_multipliers
from meshcone.program.effort import candidates
from meshcone.program.paper import centroid_program, refine_centroid
from meshcone.program.request import SourceLabels
from meshcone.program.rounds import RoundCallback, SurfaceRefiner
from meshcone.surface.arrays import Floats


class Formulated(abc.ABC):
    """A formulation of one pair."""

    @abc.abstractmethod
    def solve(self, on_round: RoundCallback) -> RefinedPositions:
        """Solve it."""

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

    def into_program(self, positions: Floats) -> Floats:
        """Map answers (n, 3) in the frame to the program's own variable."""
        return positions


class _Surface(Formulated):
    def __init__(self, pair: Pair, options: Options) -> None:
        labels = SourceLabels(pair.source_asset.regions, pair.source_asset.weld)
        self._options = options
        self._refiner = SurfaceRefiner(
            pair.source, pair.reference, options, pair.frame.radius, labels
        )

    def solve(self, on_round: RoundCallback) -> RefinedPositions:
        return self._refiner.run(on_round)

    def rebuild(
        self,
        candidate: str,
        round_index: int,
        before: Floats,
        positions: Floats,
        multipliers: MultiplierTable,
    ) -> FinalProgram:
        named = {tried.name: tried for tried in candidates(self._options)}
        if candidate not in named:
            raise InputError(f"the options know no setting '{candidate}'")
        problem = self._refiner.problem(named[candidate])
        if round_index >= problem.rounds:
            raise InputError(f"the setting '{candidate}' has {problem.rounds} rounds")
        objective, families = problem.program(round_index, before)
        attached = attach_multipliers(families, multipliers)
        return FinalProgram(round_index, before, objective, families, positions, attached)


class _Centroid(Formulated):
    def __init__(self, pair: Pair, options: Options) -> None:
        self._pair, self._options = pair, options
        self._objective, self._caps, _ = centroid_program(pair.source, pair.reference, options)

    def solve(self, on_round: RoundCallback) -> RefinedPositions:
        answer = refine_centroid(self._pair.source, self._pair.reference, self._options)
        on_round(1, 1)
        return answer

    def rebuild(
        self,
        candidate: str,
        round_index: int,
        before: Floats,
        positions: Floats,
        multipliers: MultiplierTable,
    ) -> FinalProgram:
        if candidate != "as set" or round_index != 0:
            raise InputError("the centroid formulation has one setting and one round")
        if not np.array_equal(before, self._pair.source.vertices):
            raise InputError("the centroid formulation starts at the source")
        attached = attach_multipliers([self._caps], multipliers)
        return FinalProgram(0, before, self._objective, [self._caps], positions, attached)

    def into_program(self, positions: Floats) -> Floats:
        centroid = self._objective.centroid
        return centroid + (positions - centroid) / self._objective.undo_scale


def formulate(pair: Pair, options: Options) -> Formulated:
    """Put a pair under the formulation its options choose."""
    return (
        _Centroid(pair, options) if options.formulation == "centroid" else _Surface(pair, options)
    )
