"""The surface program's objective for one round: distances to planes, both ways.

    minimise  Σ_i w_i [ (n_i·(x_i − p_i))² + τ‖x_i − p_i‖² ]                   source → reference
            + Σ_j v_j [ (m_j·((BX)_j − q_j))² + τ‖(BX)_j − q_j‖² ]             reference → source
            + λ‖X − X_prev‖² + Σ_i b_i‖(L X)_i‖²                               proximity, fairness

p_i, n_i are the closest reference point to vertex i and its normal; q_j, m_j are
reference samples and their normals, and (BX)_j is the point of the moving source they
pull at, fixed in barycentric coordinates. Correspondences are data here: they are
chosen between rounds, which is what keeps each round convex.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from meshcone.program.vertex_blocks import VertexBlocks
from meshcone.surface.arrays import Floats, Ints, row_dot


@dataclass(frozen=True)
class PlanePull:
    """Weighted squared distances of k points to k planes through target points.

    Attributes:
        weights: (k,) w ≥ 0.
        normals: (k, 3) unit plane normals.
        targets: (k, 3) points on the planes.
        tangential: τ, the weight of the distance within the plane.
    """

    weights: Floats
    normals: Floats
    targets: Floats
    tangential: float

    @cached_property
    def _weighted_normals(self) -> Floats:
        return self.weights[:, None] * self.normals

    @cached_property
    def _weighted_tangential(self) -> Floats:
        return self.tangential * self.weights[:, None]

    def apply(self, points: Floats) -> Floats:
        """Apply w (n nᵀ + τ I) to each of (k, 3) points."""
        result = self._weighted_tangential * points
        result += self._weighted_normals * row_dot(self.normals, points)[:, None]
        return result

    @property
    def blocks(self) -> VertexBlocks:
        """The matrices w (n nᵀ + τ I), k of them."""
        return VertexBlocks.of_planes(self.weights, self.normals, self.tangential)

    @property
    def value_at_zero(self) -> float:
        """The pull's value when every point is at the origin."""
        along = row_dot(self.normals, self.targets) ** 2
        return float(
            np.sum(self.weights * (along + self.tangential * np.sum(self.targets**2, axis=1)))
        )


@dataclass(frozen=True)
class SurfacePoints:
    """Points carried by a moving mesh, fixed in barycentric coordinates.

    Attributes:
        corners: (k, 3) vertex indices of the face each point lies on.
        weights: (k, 3) barycentric coordinates.
        vertex_count: n.
    """

    corners: Ints
    weights: Floats
    vertex_count: int

    @cached_property
    def gather(self) -> sparse.csr_array:
        """B of shape (k, n): positions to points."""
        count = len(self.corners)
        offsets = np.arange(0, 3 * count + 1, 3)
        data = (self.weights.ravel(), self.corners.ravel(), offsets)
        return sparse.csr_array(data, shape=(count, self.vertex_count))

    @cached_property
    def scatter(self) -> sparse.csr_array:
        """Bᵀ of shape (n, k)."""
        return self.gather.T.tocsr()


@dataclass(frozen=True)
class SurfaceObjective:
    """One round's objective as ½ xᵀP x + cᵀx + constant.

    Attributes:
        forward: the source's vertices pulled to the reference, n of them.
        backward: reference samples pulling at the source, or None.
        carried: the source points ``backward`` pulls at, or None.
        previous: (n, 3) X_prev.
        proximity: λ.
        laplacian: (n, n) L, uniform: each vertex minus the mean of its neighbours.
        fairness: (n,) b.
    """

    forward: PlanePull
    backward: PlanePull | None
    carried: SurfacePoints | None
    previous: Floats
    proximity: float
    laplacian: sparse.csr_array
    fairness: Floats

    @cached_property
    def linear(self) -> Floats:
        """The vector c, (3n,)."""
        pulled = self.forward.apply(self.forward.targets) + self.proximity * self.previous
        if self.backward is not None and self.carried is not None:
            pulled = pulled + self.carried.scatter @ self.backward.apply(self.backward.targets)
        return np.asarray(-2 * pulled).ravel()

    @cached_property
    def constant(self) -> float:
        """The objective's value at X = 0."""
        backward = 0.0 if self.backward is None else self.backward.value_at_zero
        return float(
            self.forward.value_at_zero + backward + self.proximity * np.sum(self.previous**2)
        )

    @cached_property
    def _laplacian_transposed(self) -> sparse.csr_array:
        return self.laplacian.T.tocsr()

    @cached_property
    def _fairness_transposed(self) -> sparse.csr_array:
        return (self._laplacian_transposed @ sparse.diags_array(self.fairness)).tocsr()

    def apply(self, x: Floats) -> Floats:
        """Return P x for (3n,), a few sparse products."""
        positions = x.reshape(-1, 3)
        result = self.forward.apply(positions)
        result += self.proximity * positions
        result += self._fairness_transposed @ (self.laplacian @ positions)
        if self.backward is not None and self.carried is not None:
            points = self.carried.gather @ positions
            result += self.carried.scatter @ self.backward.apply(points)
        return np.asarray(2 * result).ravel()

    def diagonal_blocks(self) -> VertexBlocks:
        """Return the 3×3 blocks on the diagonal of P."""
        isotropic = self.laplacian.power(2).T @ self.fairness + self.proximity
        result = self.forward.blocks.plus_isotropic(isotropic)
        if self.backward is not None and self.carried is not None:
            shares = self.carried.scatter.power(2)
            result += VertexBlocks(shares @ self.backward.blocks.entries)
        return result.scaled(2)

    def matrix(self) -> sparse.csc_array:
        """Return P, (3n, 3n)."""
        count = len(self.previous)
        forward = self.forward
        isotropic = (
            sparse.diags_array(forward.weights * forward.tangential + self.proximity)
            + self._fairness_transposed @ self.laplacian
        )
        normal = _normal_rows(forward, np.arange(count)[:, None], np.ones((count, 1)), count)
        quadratic = normal.T @ normal
        if self.backward is not None and self.carried is not None:
            backward, carried = self.backward, self.carried
            weights = sparse.diags_array(backward.weights * backward.tangential)
            isotropic = isotropic + carried.scatter @ weights @ carried.gather
            rows = _normal_rows(backward, carried.corners, carried.weights, count)
            quadratic = quadratic + rows.T @ rows
        doubled = 2 * (quadratic + sparse.kron(isotropic, sparse.eye_array(3)))
        return sparse.csc_array(doubled)


def _normal_rows(
    pull: PlanePull, vertices: Ints, weights: Floats, vertex_count: int
) -> sparse.csr_array:
    """Write rows √w n·(Σ_v weight_v x_v) over the 3n coordinates."""
    scaled = np.sqrt(pull.weights)[:, None] * pull.normals
    values = weights[:, :, None] * scaled[:, None, :]
    columns = 3 * vertices[:, :, None] + np.arange(3)
    per_row = 3 * vertices.shape[1]
    offsets = np.arange(0, per_row * len(vertices) + 1, per_row)
    data = (values.ravel(), columns.ravel(), offsets)
    return sparse.csr_array(data, shape=(len(vertices), 3 * vertex_count))
