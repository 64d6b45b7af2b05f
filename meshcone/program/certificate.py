"""Optimality of a point, recomputed from the program's data without a solver.

For minimise ½ xᵀP x + cᵀx subject to b − A x ∈ K, a point x with multipliers y ∈ K* is
optimal exactly when x is feasible, P x + c + Aᵀy = 0, and xᵀP x + cᵀx + bᵀy = 0 (paper,
section "Theoretical Properties"). The residuals here say by how much it is not, relative to
one plus the size of their terms, as the DIMACS error measures and SCS's own termination
test are. The last condition says that yᵀs = 0 for each cone; that is measured too, cone by
cone and as a length.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from meshcone.errors import InputError
from meshcone.program.cones import ConeFamily, cone_violation
from meshcone.program.conic import QuadraticObjective
from meshcone.program.diagnostics import Residuals
from meshcone.program.multipliers import Multipliers
from meshcone.surface.arrays import Floats, Ints, row_lengths


def residuals(
    objective: QuadraticObjective,
    families: Sequence[ConeFamily],
    positions: Floats,
    multipliers: Sequence[Multipliers],
) -> Residuals:
    """Compute the residuals of a point.

    Args:
        objective: P and c.
        families: every constraint; the primal residual is taken over all of them.
        positions: (n, 3) x.
        multipliers: y, where it is not zero.
    """
    x = positions.ravel()
    Px, c = objective.apply(x), objective.linear
    Aty, by, outside, apart = np.zeros_like(x), 0.0, 0.0, 0.0
    for entry in multipliers:
        A, b = entry.family.rows(entry.which, len(positions))
        y = entry.values.ravel()
        Aty += A.T @ y
        by += float(b @ y)
        if entry.family.cone != "zero":  # the dual of the zero cone is everything
            outside = max(outside, _largest(cone_violation(entry.family.cone, entry.values)))
            apart = max(apart, _largest(_distance_to_bound(entry, positions)))
    scale = 1 + max(_largest(Px), _largest(c), _largest(Aty))
    terms = (float(x @ Px), float(c @ x), by)
    return Residuals(
        primal=max((_largest(family.violation(positions)) for family in families), default=0.0),
        dual=max(_largest(Px + c + Aty), outside) / scale,
        gap=abs(sum(terms)) / (1 + max(map(abs, terms))),
        complementarity=apart,
    )


def _distance_to_bound(entry: Multipliers, positions: Floats) -> Floats:
    """Return |yᵀs|/‖y‖ of each cone, (j,); a sum over all cones would let many hide one."""
    slack = entry.family.slack(positions)[entry.which]
    norms = np.maximum(row_lengths(entry.values), 1e-300)
    return np.asarray(np.abs(np.sum(slack * entry.values, axis=1)) / norms)


MultiplierTable = Mapping[str, tuple[Ints, Floats]]


def attach_multipliers(
    families: Sequence[ConeFamily], table: MultiplierTable
) -> tuple[Multipliers, ...]:
    """Give stored multipliers, by kind, to the families they belong to.

    Raises:
        InputError: a kind, an index or a shape that no family has.
    """
    by_kind = {family.kind: family for family in families}
    attached: list[Multipliers] = []
    for kind, (which, values) in table.items():
        family = by_kind.get(kind)
        if family is None:
            raise InputError(
                f"the certificate has multipliers of '{kind}', the program no such cone"
            )
        if values.shape != (len(which), family.dimension):
            raise InputError(f"the certificate's multipliers of '{kind}' have the wrong shape")
        if len(which) and not (which.min() >= 0 and which.max() < len(family)):
            raise InputError(f"the certificate names '{kind}' cones that do not exist")
        if len(np.unique(which)) != len(which):
            raise InputError(f"the certificate names a '{kind}' cone twice")
        attached.append(Multipliers(family, which, values))
    return tuple(attached)


def _largest(vector: Floats) -> float:
    return float(np.abs(vector).max(initial=0.0))
