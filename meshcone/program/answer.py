"""What a formulation answers with."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from meshcone.program.cones import ConeFamily
from meshcone.program.conic import QuadraticObjective
from meshcone.program.diagnostics import RegionsRecord, RoundRecord
from meshcone.program.multipliers import Multipliers
from meshcone.quality.closeness import Gain
from meshcone.surface.arrays import Floats


@dataclass(frozen=True)
class FinalProgram:
    """The last round's program with its optimum: what the certificate is about.

    Attributes:
        round_index: which round it is, counted from 0.
        before: (n, 3) where the round before left the vertices; what it was built from.
        objective: its objective.
        families: its constraints.
        positions: (n, 3) its optimum, before any similarity undoes a shrink.
        multipliers: the dual variables that are not zero.
    """

    round_index: int
    before: Floats
    objective: QuadraticObjective
    families: Sequence[ConeFamily]
    positions: Floats
    multipliers: Sequence[Multipliers]


@dataclass(frozen=True)
class RefinedPositions:
    """Where a formulation put the vertices.

    Attributes:
        positions: (n, 3) in the reference's frame.
        rounds: what happened in each round.
        final: the last round's program, or None where the input was kept or there was no round.
        candidate: name of the settings that were kept.
        copied_reference: the program was anchored at the reference's own vertices, so its
            answer is a copy of the reference and no refinement.
        misaligned: why source and reference do not fit, in a sentence, where nothing was
            solved for that reason and the input is returned.
        kept_because: in what the best answer was worse than the input, a clause each, where
            every answer was worse somewhere and the input is returned.
        gain: how much closer the answer is than the input, where it was held against that.
        confirm_seconds: spent on SCS confirming the last round.
        regions: how the mesh was divided to be solved, if it was.
    """

    positions: Floats
    rounds: list[RoundRecord]
    final: FinalProgram | None
    candidate: str = "as set"
    copied_reference: bool = False
    misaligned: str | None = None
    kept_because: tuple[str, ...] = ()
    gain: Gain | None = None
    confirm_seconds: float = 0.0
    regions: RegionsRecord | None = None

    @property
    def kept_input(self) -> bool:
        """Whether the input is the answer: the pair does not fit, or each answer did harm."""
        return self.misaligned is not None or bool(self.kept_because)
