"""Vertices that a round leaves where the input has them, and an objective of the others.

What is held enters the objective as data: the program over the other vertices is the same as
with the held ones pinned by a cone each, and costs no cones.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from meshcone.program.surface_objective import SurfaceObjective
from meshcone.program.vertex_blocks import VertexBlocks
from meshcone.surface.arrays import Bools, Floats

# Of P's diagonal at a held vertex, about what it is at others: only a cone that binds there
# could move it.
_STIFFNESS = 20.0


@dataclass(frozen=True)
class HeldObjective:
    """A round's objective with some vertices in given places, as ½ xᵀP x + cᵀx + constant.

    Where they are in their places it has the value of the objective it is made of.

    Attributes:
        whole: the objective over all vertices.
        held: (n,) which are held.
        places: (n, 3) where; read at held vertices only.
    """

    whole: SurfaceObjective
    held: Bools
    places: Floats

    @cached_property
    def linear(self) -> Floats:
        """The vector c, (3n,)."""
        fixed = self._fixed
        moved = self.whole.linear + self.whole.apply(fixed)
        return np.where(self._rows, -_STIFFNESS * fixed, moved)

    @cached_property
    def constant(self) -> float:
        """The objective's value at X = 0."""
        fixed, whole = self._fixed, self.whole
        inside = whole.constant + whole.linear @ fixed + fixed @ whole.apply(fixed) / 2
        return float(inside + _STIFFNESS * (fixed @ fixed) / 2)

    def apply(self, x: Floats) -> Floats:
        """Return P x for (3n,)."""
        return self._around(self.whole.apply, x)

    def product(self) -> Callable[[Floats], Floats]:
        """Return x ↦ P x as a function worth its preparation when it is called dozens of times."""
        inner = self.whole.product()
        return lambda x: self._around(inner, x)

    def diagonal_blocks(self) -> VertexBlocks:
        """Return the 3×3 blocks on the diagonal of P."""
        entries = self.whole.diagonal_blocks().entries
        alone = np.array([_STIFFNESS] * 3 + [0.0] * 3)
        return VertexBlocks(np.where(self.held[:, None], alone, entries))

    def matrix(self) -> sparse.csc_array:
        """Return P, (3n, 3n)."""
        kept = sparse.diags_array((~self._rows).astype(np.float64))
        alone = sparse.diags_array(np.where(self._rows, _STIFFNESS, 0.0))
        return sparse.csc_array(kept @ self.whole.matrix() @ kept + alone)

    def _around(self, multiply: Callable[[Floats], Floats], x: Floats) -> Floats:
        result = multiply(np.where(self._rows, 0.0, x))
        return np.where(self._rows, _STIFFNESS * x, result)

    @cached_property
    def _rows(self) -> Bools:
        return np.repeat(self.held, 3)

    @cached_property
    def _fixed(self) -> Floats:
        return np.where(self.held[:, None], self.places, 0.0).ravel()
