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

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from meshcone.program.coupled_blocks import coupled_blocks
from meshcone.program.fairness import Fairness
from meshcone.program.fused import (
    add_carried,
    add_carried_blocks,
    add_pulled,
    add_pulled_blocks,
    add_to_corners,
)
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
            forces = self.backward.apply(self.backward.targets)
            add_to_corners(self.carried.corners, self.carried.weights, forces, pulled)
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
        entries = np.zeros((len(self.previous), 6))
        entries[:, :3] = self.proximity
        forward, backward, carried = self.forward, self.backward, self.carried
        add_pulled_blocks(forward.weights, forward.normals, forward.tangential, entries)
        self.fairness.add_blocks_to(entries)
        if backward is not None and carried is not None:
            at, pull = (carried.corners, carried.weights), (backward.weights, backward.normals)
            add_carried_blocks(*at, *pull, backward.tangential, entries)
        return VertexBlocks(2 * entries)

    def matrix(self) -> sparse.csc_array:
        """Return P, (3n, 3n)."""
        fairness = self.fairness
        whole = self._coupled([fairness.laplacian], [fairness.blocks]).tocsr()
        whole.eliminate_zeros()  # fairness alone couples no two directions
        # What is symmetric has the same arrays by rows and by columns.
        return sparse.csc_array((2 * whole.data, whole.indices, whole.indptr), shape=whole.shape)

    def product(self) -> Callable[[Floats], Floats]:
        """Return x ↦ P x as a function worth its preparation when it is called dozens of times."""
        if len(self.previous) > _ASSEMBLED_UP_TO:
            return self.apply
        data = self._coupled()

        def apply(x: Floats) -> Floats:
            smoothed = self.fairness.apply(x.reshape(-1, 3))
            return np.asarray(2 * (data @ x + smoothed.ravel()))

        return apply

    def _coupled(
        self, factors: Sequence[sparse.csr_array] = (), blocks: Sequence[VertexBlocks] = ()
    ) -> sparse.bsr_array:
        """Return ½ P without the fairness, but with what other rows add."""
        forward = self.forward.blocks.plus_isotropic(np.array(self.proximity))
        factors = [sparse.eye_array(len(self.previous), format="csr"), *factors]
        blocks = [forward, *blocks]
        if self.backward is not None and self.carried is not None:
            factors.append(self.carried.gather)
            blocks.append(self.backward.blocks)
        entries = np.concatenate([each.entries for each in blocks])
        stacked = sparse.csr_array(sparse.vstack(factors, format="csr"))
        return coupled_blocks(stacked, VertexBlocks(entries))
