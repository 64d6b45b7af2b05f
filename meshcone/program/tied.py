"""An objective of a mesh some of whose vertices follow others.

Where they follow, it has the value of the objective it is made of; where they do not, what they
lack of it counts besides. So it is strictly convex, and without other constraints its optimum is
that of the free vertices alone, with all others where they belong.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from meshcone.program.relaxation import PreconditionedObjective
from meshcone.program.ties import Ties
from meshcone.program.vertex_blocks import VertexBlocks
from meshcone.surface.arrays import Floats

# Of P's diagonal at a vertex that follows, about what it is at others.
_STIFFNESS = 20.0


@dataclass(frozen=True)
class TiedObjective:
    """f(W X + O) + κ/2 ‖T (X − W X − O)‖² as ½ xᵀP x + cᵀx + constant.

    W X + O are the positions with what follows, T, where it belongs.

    Attributes:
        whole: f, over all vertices.
        ties: which vertices follow which.
    """

    whole: PreconditionedObjective
    ties: Ties

    @cached_property
    def linear(self) -> Floats:
        """The vector c, (3n,)."""
        offsets = self.ties.offsets
        inside = self.whole.linear + self.whole.apply(offsets.ravel())
        pulled = self._weights.T @ inside.reshape(-1, 3)
        return np.asarray(pulled - _STIFFNESS * (self._lacking.T @ offsets)).ravel()

    @cached_property
    def constant(self) -> float:
        """The objective's value at X = 0."""
        fixed, whole = self.ties.offsets.ravel(), self.whole
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
        """Return the 3×3 blocks on the diagonal of P, but for what couples two vertices in f.

        They only precondition.
        """
        entries = self._weights.power(2).T @ self.whole.diagonal_blocks().entries
        entries[:, :3] += _STIFFNESS * self._lacking.power(2).sum(axis=0)[:, None]
        return VertexBlocks(np.asarray(entries))

    def matrix(self) -> sparse.csc_array:
        """Return P, (3n, 3n)."""
        three = sparse.eye_array(3)
        weights, lacking = (sparse.kron(each, three) for each in (self._weights, self._lacking))
        inside = weights.T @ self.whole.matrix() @ weights
        return sparse.csc_array(inside + _STIFFNESS * (lacking.T @ lacking))

    def _around(self, multiply: Callable[[Floats], Floats], x: Floats) -> Floats:
        positions = x.reshape(-1, 3)
        inside = multiply(np.asarray(self._weights @ positions).ravel()).reshape(-1, 3)
        lacking = self._lacking.T @ (self._lacking @ positions)
        return np.asarray(self._weights.T @ inside + _STIFFNESS * lacking).ravel()

    @property
    def _weights(self) -> sparse.csr_array:
        return self.ties.weights

    @cached_property
    def _lacking(self) -> sparse.csr_array:
        """X ↦ T (X − W X), (n, n)."""
        tied = sparse.diags_array(self.ties.tied.astype(np.float64))
        return sparse.csr_array(tied - tied @ self.ties.weights)
