"""Which constraints contradict each other, read from a certificate of infeasibility.

Where no point satisfies b − A x ∈ K, SCS returns y ∈ K* with Aᵀy = 0 and bᵀy < 0: a
combination of the constraints that cannot hold. The cones with weight in y are the ones
in conflict.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from meshcone.errors import InfeasibleError
from meshcone.program.conic import ConicProgram
from meshcone.surface.arrays import Floats, Ints, row_lengths

# Cones with less than this share of the largest weight are the certificate's rounding.
_WEIGHT_SHARE = 0.05


@dataclass(frozen=True)
class Conflict:
    """The cones of one kind that take part in a contradiction.

    Attributes:
        kind: the kind.
        count: how many cones of it.
        vertices: the vertices they touch, the most heavily weighted first.
    """

    kind: str
    count: int
    vertices: Ints


class ContradictionError(InfeasibleError):
    """No mesh satisfies the requested constraints.

    Attributes:
        conflicts: the kinds that contradict each other, the heaviest first.
    """

    def __init__(self, conflicts: tuple[Conflict, ...]) -> None:
        kinds = " and ".join(f"'{conflict.kind}'" for conflict in conflicts)
        super().__init__(f"the requested constraints contradict each other: {kinds}")
        self.conflicts = conflicts


def read_conflicts(program: ConicProgram, certificate: Floats) -> tuple[Conflict, ...]:
    """Read the conflicting cones from a certificate of infeasibility y (m,)."""
    largest = float(np.abs(certificate).max(initial=0.0))
    found: list[tuple[float, Conflict]] = []
    row = 0
    for selection in program.selections:
        family = selection.family
        block = certificate[row : row + selection.size].reshape(-1, family.dimension)
        row += selection.size
        weights = row_lengths(block)
        heavy = np.flatnonzero(weights > _WEIGHT_SHARE * largest)
        if not len(heavy):
            continue
        order = heavy[np.argsort(-weights[heavy], kind="stable")]
        touched = family.vertices[selection.which[order]].ravel()
        _, first = np.unique(touched, return_index=True)
        conflict = Conflict(family.kind, len(heavy), touched[np.sort(first)])
        found.append((float(weights.max()), conflict))
    found.sort(key=lambda entry: -entry[0])
    return tuple(conflict for _, conflict in found)
