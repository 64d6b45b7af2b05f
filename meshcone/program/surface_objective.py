"""The surface program's objective for one round: distances to planes, both ways.

    minimise  Σ_i w_i [ (n_i·(x_i − p_i))² + τ‖x_i − p_i‖² ]                   source → reference
            + Σ_j v_j [ (m_j·((BX)_j − q_j))² + τ‖(BX)_j − q_j‖² ]             reference → source
            + λ‖X − X_prev‖² + Σ_i (L X − T)_iᵀ W_i (L X − T)_i                proximity, fairness

p_i, n_i are the closest reference point to vertex i and its normal. (BX)_j is a point of the
moving source, fixed in barycentric coordinates, and q_j, m_j a point of the reference and
its normal: a sample of the reference and the source's closest point to it, or in the last
rounds a sample of the source's faces and its closest point. Correspondences are data here: they are
chosen between rounds, which is what keeps each round convex.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from meshcone.program.fairness import Fairness
from meshcone.program.fused import add_carried, add_pulled
from meshcone.program.pulls import PlanePull, SurfacePoints
from meshcone.program.vertex_blocks import VertexBlocks
from meshcone.surface.arrays import Floats

# A matrix of more vertices' blocks does not stay in the cache: reading it then takes as long
# as doing without it.
_ASSEMBLED_UP_TO = 20_000


@dataclass(frozen=True)
class SurfaceObjective:
    """One round's objective as ½ xᵀP x + cᵀx + constant.

    Attributes:
        forward: the source's vertices pulled to the reference, n of them.
        backward: reference samples pulling at the source, or None.
        carried: the source points ``backward`` pulls at, or None.
        previous: (n, 3) X_prev.
        proximity: λ.
        fairness: L, W and T.
    """

    forward: PlanePull
    backward: PlanePull | None
    carried: SurfacePoints | None
    previous: Floats
    proximity: float
    fairness: Fairness

    @cached_property
    def linear(self) -> Floats:
        """The vector c, (3n,)."""
        pulled = self.forward.apply(self.forward.targets) + self.proximity * self.previous
        pulled = pulled + self.fairness.pulled
        if self.backward is not None and self.carried is not None:
            pulled = pulled + self.carried.scatter @ self.backward.apply(self.backward.targets)
        return np.asarray(-2 * pulled).ravel()

    @cached_property
    def constant(self) -> float:
        """The objective's value at X = 0."""
        backward = 0.0 if self.backward is None else self.backward.value_at_zero
        return float(
            self.forward.value_at_zero
            + backward
            + self.proximity * np.sum(self.previous**2)
            + self.fairness.value_at_zero
        )

    def apply(self, x: Floats) -> Floats:
        """Return P x for (3n,), a few sparse products."""
        positions = x.reshape(-1, 3)
        result = self.proximity * positions
        forward, backward, carried = self.forward, self.backward, self.carried
        add_pulled(positions, forward.weights, forward.normals, forward.tangential, result)
        self.fairness.add_to(result, positions)
        if backward is not None and carried is not None:
            at, pull = (carried.corners, carried.weights), (backward.weights, backward.normals)
            add_carried(positions, *at, *pull, backward.tangential, result)
        return np.asarray(2 * result).ravel()

    def diagonal_blocks(self) -> VertexBlocks:
        """Return the 3×3 blocks on the diagonal of P."""
        result = self.forward.blocks + self.fairness.diagonal_blocks
        result = result.plus_isotropic(np.full(len(self.previous), self.proximity))
        if self.backward is not None and self.carried is not None:
            shares = self.carried.scatter.power(2)
            result += VertexBlocks(shares @ self.backward.blocks.entries)
        return result.scaled(2)

    def matrix(self) -> sparse.csc_array:
        """Return P, (3n, 3n)."""
        return sparse.csc_array(2 * (self._data_blocks().tocsr() + self.fairness.matrix()))

    def product(self) -> Callable[[Floats], Floats]:
        """Return x ↦ P x as a function worth its preparation when it is called dozens of times."""
        if len(self.previous) > _ASSEMBLED_UP_TO:
            return self.apply
        data = self._data_blocks()

        def apply(x: Floats) -> Floats:
            smoothed = self.fairness.apply(x.reshape(-1, 3))
            return np.asarray(2 * (data @ x + smoothed.ravel()))

        return apply

    def _data_blocks(self) -> sparse.bsr_array:
        """Return ½ P without the fairness, whose 3×3 blocks couple the corners of faces.

        Written as RᵀR, where R has a block for every vertex a pull acts on.
        """
        count = len(self.previous)
        places, roots = [np.arange(count)], [self.forward.roots(self.proximity)]
        lengths = [np.ones(count, dtype=np.int64)]
        if self.backward is not None and self.carried is not None:
            carried = self.carried
            shares = carried.weights[:, :, None, None] * self.backward.roots()[:, None]
            places.append(carried.corners.ravel())
            roots.append(shares.reshape(-1, 3, 3))
            lengths.append(np.full(len(carried.corners), 3))
        offsets = np.concatenate([[0], np.cumsum(np.concatenate(lengths))]).astype(np.int32)
        data = (np.concatenate(roots), np.concatenate(places).astype(np.int32), offsets)
        shape = (3 * (len(offsets) - 1), 3 * count)
        factor = sparse.bsr_array(data, shape=shape)
        return sparse.bsr_array(factor.T @ factor)
