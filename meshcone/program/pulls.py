"""Points pulled to planes, and points that a mesh carries along."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from meshcone.program.fused import add_pulled
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

    def apply(self, points: Floats) -> Floats:
        """Apply w (n nᵀ + τ I) to each of (k, 3) points."""
        result = np.zeros_like(points)
        add_pulled(points, self.weights, self.normals, self.tangential, result)
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

    @property
    def gather(self) -> sparse.csr_array:
        """B of shape (k, n): positions to points."""
        count = len(self.corners)
        offsets = np.arange(0, 3 * count + 1, 3, dtype=np.int32)
        data = (self.weights.ravel(), self.corners.ravel().astype(np.int32), offsets)
        return sparse.csr_array(data, shape=(count, self.vertex_count))
