"""Solving a round region by region: restricted additive Schwarz.

Each region solves for its vertices with all others held where the round found them, and keeps
what it finds for its own. The rounds of a refinement are the rounds of the method: in the next,
neighbours see where the others have gone. The last round is finished as one program, from a point
that is nearly its optimum: what is certified is the optimum of the whole.

Pulls and fairness fade within a few rings of edges. Tension does not: where edges are held at
their caps, each passes on what pulls at the other. A round whose tight cones form a chain that
leads out of a region is finished as one program too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from meshcone.options import SolverOptions
from meshcone.processes import each_of
from meshcone.program.cones import ConeFamily
from meshcone.program.multipliers import Multipliers
from meshcone.program.regions import Region
from meshcone.program.relaxation import PreconditionedObjective
from meshcone.program.restriction import RestrictedCones, restricted_objective
from meshcone.program.round_solver import Method, RoundSolution, Settled, solve_round
from meshcone.program.surface_objective import SurfaceObjective
from meshcone.program.vertex_blocks import VertexBlocks
from meshcone.program.work import Allowance
from meshcone.surface.arrays import Floats, Ints


@dataclass(frozen=True)
class _Answer:
    """What a region found for its own.

    Attributes:
        positions: (k, 3) of its own vertices.
        multipliers: for each family, which of its cones have one, and their values.
        passes: selections of cones it took.
        converged: whether the method that found it reached its tolerance.
    """

    positions: Floats
    multipliers: list[tuple[Ints, Floats]]
    passes: int
    converged: bool


def solve_apart(
    regions: Sequence[Region],
    objective: SurfaceObjective,
    families: Sequence[ConeFamily],
    start: Floats,
    options: SolverOptions,
    reduction: float,
    known: Sequence[Multipliers],
) -> RoundSolution:
    """Solve a round's program in each region and put the answers together.

    The arguments are those of :func:`solve_round`; where regions meet, the answer is no optimum.

    Args:
        regions: whose own vertices are all there are.
        objective: of the whole mesh.
        families: every constraint.
        start: (n, 3) first guess, and where what is not free is held.
        options: method, tolerance and limits.
        reduction: how far CG need reduce the gradient of a region's relaxation.
        known: multipliers of the round before.
    """

    def work(index: int) -> _Answer:
        region = regions[index]
        return _solved(region, objective, families, start, options, reduction, known)

    positions = np.empty_like(start)
    found: list[list[tuple[Ints, Floats]]] = [[] for _ in families]
    passes, converged = 0, True
    with closing(each_of(len(regions), work)) as answers:
        for region, answer in zip(regions, answers, strict=True):
            positions[region.own] = answer.positions
            for whole, part in zip(found, answer.multipliers, strict=True):
                whole.append(part)
            passes, converged = max(passes, answer.passes), converged and answer.converged
    multipliers = tuple(
        entry
        for family, parts in zip(families, found, strict=True)
        if len((entry := _together(family, parts)).which)
    )
    method: Method = "multipliers" if passes else "relaxation"
    return RoundSolution(positions, multipliers, method, passes, converged=converged)


def solve_together(
    objective: PreconditionedObjective,
    families: Sequence[ConeFamily],
    start: Floats,
    options: SolverOptions,
    reduction: float,
    known: Sequence[Multipliers],
    settled: Settled | None = None,
    *,
    allowance: Allowance | None = None,
) -> tuple[RoundSolution, int]:
    """Solve the whole program, from where its regions have brought it.

    Returns:
        What :func:`solve_round` does, and how many products with the whole matrix it took.
    """
    counted = _CountedObjective(objective)
    solution = solve_round(
        counted, families, start, options, reduction, known, settled, allowance=allowance
    )
    return solution, counted.products


def within_regions(
    regions: Sequence[Region], multipliers: Sequence[Multipliers], vertices: int
) -> bool:
    """Tell whether no chain of tight cones leads from a region's own vertices out of it.

    Args:
        regions: of a mesh of so many vertices.
        multipliers: of the cones that are tight.
        vertices: how many.
    """
    links = [
        np.stack([touched[:, 0], other], axis=1)
        for entry in multipliers
        for touched in (entry.family.vertices[entry.which],)
        for other in touched.T[1:]
    ]
    if not links:
        return True
    one, other = np.concatenate(links).T
    graph = sparse.coo_array((np.ones(len(one)), (one, other)), shape=(vertices, vertices))
    _, chain = connected_components(graph, directed=False)
    for region in regions:
        inside = np.zeros(vertices, dtype=bool)
        inside[region.free] = True
        begun = np.zeros(vertices, dtype=bool)  # chains, by their numbers
        begun[chain[region.own]] = True
        if (begun[chain] & ~inside).any():
            return False
    return True


def _solved(
    region: Region,
    objective: SurfaceObjective,
    families: Sequence[ConeFamily],
    start: Floats,
    options: SolverOptions,
    reduction: float,
    known: Sequence[Multipliers],
) -> _Answer:
    cones = [RestrictedCones.of(family, region.free, len(start)) for family in families]
    solution = solve_round(
        restricted_objective(objective, region.free, start),
        [each.family for each in cones],
        start[region.free],
        options,
        reduction=reduction,
        known=[entry for each in cones for entry in each.inward(known)],
    )
    own = np.zeros(len(start), dtype=bool)
    own[region.own] = True
    return _Answer(
        positions=solution.positions[own[region.free]],
        multipliers=[each.outward(solution.multipliers, own) for each in cones],
        passes=solution.passes,
        converged=solution.converged,
    )


def _together(family: ConeFamily, parts: Sequence[tuple[Ints, Floats]]) -> Multipliers:
    which = np.concatenate([part[0] for part in parts])
    values = np.concatenate([part[1] for part in parts])
    order = np.argsort(which)
    return Multipliers(family, which[order], values[order])


class _CountedObjective:
    """An objective that counts products with its matrix."""

    def __init__(self, objective: PreconditionedObjective) -> None:
        self._objective, self.products = objective, 0
        self.linear, self.constant = objective.linear, objective.constant

    def apply(self, x: Floats) -> Floats:
        """Return P x for (3n,)."""
        self.products += 1
        return self._objective.apply(x)

    def product(self) -> Callable[[Floats], Floats]:
        """Return x ↦ P x as a function worth its preparation when it is called dozens of times."""
        multiply = self._objective.product()

        def counted(x: Floats) -> Floats:
            self.products += 1
            return multiply(x)

        return counted

    def matrix(self) -> sparse.csc_array:
        """Return P, (3n, 3n)."""
        return self._objective.matrix()

    def diagonal_blocks(self) -> VertexBlocks:
        """Return the 3×3 blocks on the diagonal of P."""
        return self._objective.diagonal_blocks()
