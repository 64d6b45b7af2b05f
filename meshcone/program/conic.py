"""The cone program in the form SCS takes (paper, section "Conic Solvers").

    minimise    ½ xᵀP x + cᵀx
    subject to  A x + s = b,  s ∈ K = {0}ᶻ × R₊ˡ × Q₁ × … × Q_q

The variable is the positions alone, 3n coordinates, vertex by vertex: the *reduced*
form, four times smaller than what a modelling language compiles the same program to.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy import sparse

from meshcone.program.cones import ConeFamily, ConeType
from meshcone.surface.arrays import Floats, Ints

_ORDER: tuple[ConeType, ...] = ("zero", "linear", "second_order")


class QuadraticObjective(Protocol):
    """A convex quadratic ½ xᵀP x + cᵀx + constant of the 3n coordinates."""

    @property
    def linear(self) -> Floats:
        """The vector c, (3n,)."""

    @property
    def constant(self) -> float:
        """The term that makes the value the sum of squares it stands for."""

    def matrix(self) -> sparse.csc_array:
        """Return P, (3n, 3n), symmetric positive semidefinite."""

    def apply(self, x: Floats) -> Floats:
        """Return P x for (3n,) without forming P."""


@dataclass(frozen=True)
class Selection:
    """Some cones of one family.

    Attributes:
        family: the family.
        which: (j,) indices of the cones taken from it.
    """

    family: ConeFamily
    which: Ints

    @property
    def size(self) -> int:
        """Number of rows the selection takes in A."""
        return len(self.which) * self.family.dimension


def everything(families: Sequence[ConeFamily]) -> list[Selection]:
    """Select every cone of every family."""
    return [Selection(family, np.arange(len(family))) for family in families]


@dataclass(frozen=True)
class Constraints:
    """The part of a program that is not its objective.

    Attributes:
        A: (m, 3n) constraint matrix, rows ordered zero, linear, second-order.
        b: (m,) right-hand side.
        selections: what the rows stand for, in their order.
    """

    A: sparse.csc_array
    b: Floats
    selections: tuple[Selection, ...]

    @property
    def cones(self) -> dict[str, int | list[int]]:
        """The cone K in SCS's notation."""
        rows = dict.fromkeys(_ORDER, 0)
        second_order: list[int] = []
        for selection in self.selections:
            rows[selection.family.cone] += selection.size
            if selection.family.cone == "second_order":
                second_order += [selection.family.dimension] * len(selection.which)
        notation: dict[str, int | list[int]] = {}
        if rows["zero"]:
            notation["z"] = rows["zero"]
        if rows["linear"]:
            notation["l"] = rows["linear"]
        if second_order:
            notation["q"] = second_order
        return notation


@dataclass(frozen=True)
class ConicProgram(Constraints):
    """The arrays SCS takes: the constraints' and these.

    Attributes:
        P: (3n, 3n) quadratic term, sparse, full symmetric.
        c: (3n,) linear term.
        constant: added to the optimum it gives the objective's own value.
    """

    P: sparse.csc_array
    c: Floats
    constant: float


def write_constraints(selections: Sequence[Selection], variables: int) -> Constraints:
    """Write the rows of the selected cones over 3n variables."""
    ordered = [s for cone in _ORDER for s in selections if s.family.cone == cone and len(s.which)]
    blocks = [s.family.rows(s.which, variables // 3) for s in ordered]
    if blocks:
        A = sparse.vstack([matrix for matrix, _ in blocks], format="csc")
        b = np.concatenate([bound for _, bound in blocks])
    else:
        A, b = sparse.csc_array((0, variables)), np.zeros(0)
    return Constraints(A, b, tuple(ordered))


def assemble(objective: QuadraticObjective, selections: Sequence[Selection]) -> ConicProgram:
    """Write the program of an objective under the selected cones."""
    rows = write_constraints(selections, len(objective.linear))
    return ConicProgram(
        A=rows.A,
        b=rows.b,
        selections=rows.selections,
        P=objective.matrix(),
        c=objective.linear,
        constant=objective.constant,
    )
