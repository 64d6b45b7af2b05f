"""What every kind of constraint says about itself.

A constraint kind is a family of ``k`` cones of one type and dimension, each touching a
few vertices. It knows how to evaluate its slack from positions, without a matrix, and
how to write the rows of any subset of its cones; everything above (assembly, active
sets, certificate, tension) works from these two.
"""

from __future__ import annotations

import abc
from dataclasses import dataclass, replace
from typing import ClassVar, Literal, Self

import numpy as np
from scipy import sparse

from meshcone.surface.arrays import Floats, Ints, row_lengths

ConeType = Literal["zero", "linear", "second_order"]

# A cone exceeded by less than this share of the radius counts as satisfied.
FEASIBILITY = 1e-7


@dataclass(frozen=True)
class ConeFamily(abc.ABC):
    """A family of ``k`` constraints ``b − A x ∈ K`` of the same kind.

    Attributes:
        kind: the name a user asks for it by.
        cone: which cone every slack lies in.
        dimension: rows per cone.
        vertices: (k, v) the vertices each cone touches.
    """

    kind: ClassVar[str]
    cone: ClassVar[ConeType]
    dimension: ClassVar[int]
    vertices: Ints

    def __len__(self) -> int:
        """Return the number of cones in the family."""
        return len(self.vertices)

    @abc.abstractmethod
    def slack(self, positions: Floats) -> Floats:
        """Evaluate ``b − A x`` at positions (n, 3), as (k, dimension)."""

    @abc.abstractmethod
    def rows(self, which: Ints, vertex_count: int) -> tuple[sparse.csr_array, Floats]:
        """Write the rows of the chosen cones.

        Args:
            which: (j,) indices of cones in this family.
            vertex_count: n; the variable is the positions' 3n coordinates, vertex by vertex.

        Returns:
            A of shape (j·dimension, 3n) and b of shape (j·dimension,).
        """

    def chosen(self, which: Ints, vertices: Ints) -> Self:
        """Return a family of some cones over other vertices.

        Every array of a family has a row for each of its cones.

        Args:
            which: (j,) the cones.
            vertices: (j, v) the vertices they touch there.
        """
        values = {name: value[which] for name, value in vars(self).items() if np.ndim(value)}
        return replace(self, **(values | {"vertices": vertices}))

    def violation(self, positions: Floats) -> Floats:
        """Return how far each slack lies outside its cone, (k,), 0 where it lies inside."""
        return cone_violation(self.cone, self.slack(positions))

    def unmet(self, positions: Floats) -> int:
        """Count the cones that (n, 3) positions exceed by more than counts."""
        return int(np.count_nonzero(self.violation(positions) > FEASIBILITY))

    def tightness(self, positions: Floats) -> Floats:
        """Return (k,) how close each cone is to being violated: above 0 it is.

        Relative to the bound for a second-order cone (``‖u‖/t − 1``), to the slack of the
        middle for linear rows.
        """
        slack = self.slack(positions)
        if self.cone == "second_order":
            bounds = np.maximum(slack[:, 0], 1e-300)
            return np.asarray(row_lengths(slack[:, 1:]) / bounds - 1)
        if self.cone == "linear":
            scale = np.maximum(np.abs(slack).mean(axis=1), 1e-300)
            return np.asarray(-slack.min(axis=1) / scale)
        return np.asarray(np.abs(slack).max(axis=1, initial=0.0))


def cone_violation(cone: ConeType, slack: Floats) -> Floats:
    """Measure how far slacks (k, d) lie outside the cone, in the unit of the slack, (k,).

    For the second-order cone this is ``‖u‖ − t``, the length by which a cap is exceeded.
    """
    if cone == "zero":
        return np.asarray(np.abs(slack).max(axis=1, initial=0.0))
    if cone == "linear":
        return np.asarray(np.maximum(-slack, 0).max(axis=1, initial=0.0))
    return np.asarray(np.maximum(row_lengths(slack[:, 1:]) - slack[:, 0], 0))


def coordinate_rows(
    vertices: Ints, vertex_count: int, *, stride: int, offset: int
) -> sparse.csr_array:
    """Write rows −x_i, three to each of (j,) vertices.

    Args:
        vertices: (j,) the vertices.
        vertex_count: n.
        stride: rows per cone.
        offset: the row in each cone that holds the first coordinate.

    Returns:
        A of shape (j·stride, 3n).
    """
    count = len(vertices)
    rows = (stride * np.arange(count)[:, None] + offset + np.arange(3)).ravel()
    columns = (3 * vertices[:, None] + np.arange(3)).ravel()
    shape = (stride * count, 3 * vertex_count)
    return sparse.coo_array((np.full(3 * count, -1.0), (rows, columns)), shape=shape).tocsr()
