"""Dual variables, by the cones they belong to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from meshcone.program.cones import ConeFamily
from meshcone.program.conic import Selection
from meshcone.program.projection import project_dual
from meshcone.surface.arrays import Floats, Ints, row_lengths

_ROUNDING = 1e-9
# A multiplier below this share of the largest is the solver's rounding.
_ACTIVE_SHARE = 1e-6


@dataclass(frozen=True)
class Multipliers:
    """The dual variables of some cones of one family; those of all others are zero.

    Attributes:
        family: the family.
        which: (j,) the cones.
        values: (j, dimension) their multipliers, in K*.
    """

    family: ConeFamily
    which: Ints
    values: Floats


def flatten(multipliers: Sequence[Multipliers], selections: Sequence[Selection]) -> Floats:
    """Write multipliers as the y (m,) of the selected cones; cones without one get zero.

    Kinds are matched by name, so that a round can start from the one before.
    """
    by_kind = {entry.family.kind: entry for entry in multipliers}
    parts: list[Floats] = []
    for selection in selections:
        part = np.zeros((len(selection.which), selection.family.dimension))
        entry = by_kind.get(selection.family.kind)
        if entry is not None:
            shared = np.isin(selection.which, entry.which)
            part[shared] = entry.values[np.isin(entry.which, selection.which)]
        parts.append(part.ravel())
    return np.concatenate(parts) if parts else np.zeros(0)


def unflatten(
    y: Floats, selections: Sequence[Selection], linear: Floats
) -> tuple[Multipliers, ...]:
    """Read the y (m,) of the selected cones as multipliers, leaving out cones whose own is zero.

    A solver's y lies in K* up to rounding: it is projected, and what is then smaller than
    the rounding of the objective's linear term (3n,) counts as zero.
    """
    y = project_dual(y, selections)
    zero = _ROUNDING * float(np.abs(linear).max(initial=0.0))
    found: list[Multipliers] = []
    row = 0
    for selection in selections:
        values = y[row : row + selection.size].reshape(-1, selection.family.dimension)
        row += selection.size
        nonzero = np.flatnonzero(row_lengths(values) > zero)
        if len(nonzero):
            found.append(
                Multipliers(selection.family, selection.which[nonzero], values[nonzero].copy())
            )
    return tuple(found)


def active_cones(
    families: Sequence[ConeFamily], multipliers: Sequence[Multipliers]
) -> dict[str, int]:
    """Count the cones with a multiplier, by kind; kinds without any are listed with 0."""
    # A certificate may name a kind without any of its cones.
    sizes = (float(np.abs(entry.values).max(initial=0.0)) for entry in multipliers)
    largest = max(sizes, default=0.0)
    active = {family.kind: 0 for family in families}
    for entry in multipliers:
        norms = row_lengths(entry.values)
        active[entry.family.kind] += int(np.count_nonzero(norms > _ACTIVE_SHARE * largest))
    return active
