"""From where a file has the vertices of a mesh to where a viewer shows them, and back.

Written out instead of as matrix products: a product's rounding may depend on a row's place in the
array, and equal vertices must stay equal to be welded.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_IDENTITY = np.eye(3, 4)
_SINGULAR = 1e-6  # of the largest singular value: below it, 32-bit floats decide what comes back


@dataclass(frozen=True)
class Pose:
    """Where the vertices of one accessor are shown.

    Attributes:
        matrices: (n, 3, 4) affine maps to world space, one for each vertex, or (1, 3, 4) for all.
        shift: (n, 3) what morph targets add before that, or None.
    """

    matrices: NDArray[np.float64]
    shift: NDArray[np.float64] | None = None

    @staticmethod
    def rigid(matrix: NDArray[np.float64], shift: NDArray[np.float64] | None = None) -> Pose:
        """All vertices under one (4, 4) affine matrix."""
        return Pose(matrix[None, :3], shift)

    @property
    def is_rigid(self) -> bool:
        """Whether one map holds for all vertices and nothing is added to them."""
        return len(self.matrices) == 1 and self.shift is None

    def place(self, local: NDArray[np.float64]) -> NDArray[np.float64]:
        """(n, 3) world positions of (n, 3) stored ones."""
        if self.shift is not None:
            local = local + self.shift
        return _turned(self.matrices, local) + self.matrices[:, :, 3]

    def restore(self, world: NDArray[np.float64], rows: NDArray[np.int64]) -> NDArray[np.float64]:
        """(k, 3) positions to store for some vertices, whose maps can be undone.

        Args:
            world: (k, 3) where they shall be shown.
            rows: (k,) which they are.
        """
        matrices = self._of(rows)
        inverses = np.linalg.inv(matrices[:, :, :3]).astype(np.float64)
        local = _turned(inverses, world - matrices[:, :, 3])
        return local if self.shift is None else local - self.shift[rows]

    def scales(self) -> NDArray[np.float64]:
        """(n,) or (1,) how much longer the maps make what they make longest of the axes."""
        return np.asarray(np.sqrt((self.matrices[:, :, :3] ** 2).sum(axis=1).max(axis=1)))

    def irreversible(self) -> NDArray[np.bool_]:
        """(n,) or (1,) which maps lose a dimension."""
        values = np.linalg.svd(self.matrices[:, :, :3], compute_uv=False)
        least = 1e-12 if self.is_rigid else _SINGULAR
        lost: NDArray[np.bool_] = values[:, 2] <= least * values[:, 0]
        return lost

    def turn_normals(
        self, normals: NDArray[np.float64], rows: NDArray[np.int64] | None = None
    ) -> NDArray[np.float64]:
        """(k, 3) unit normals in world space of those of all vertices, or of some rows."""
        matrices = self.matrices if rows is None else self._of(rows)
        if len(matrices) == 1 and np.array_equal(matrices[0, :, :3], _IDENTITY[:, :3]):
            return normals
        linear = matrices[:, :, :3]
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            # The cofactor matrix is det(M) M^-T: it needs no inverse; its length is divided out.
            sign = np.linalg.slogdet(linear).sign[:, None, None]
            turned = _turned(_cofactors(linear) * sign, normals)
            unit: NDArray[np.float64] = turned / np.linalg.norm(turned, axis=1, keepdims=True)
        return unit

    def restore_normals(
        self, normals: NDArray[np.float64], rows: NDArray[np.int64]
    ) -> NDArray[np.float64]:
        """(k, 3) unit normals to store: the inverse of n -> M^-T n is n -> M^T n."""
        local = _turned(self._of(rows)[:, :, :3].transpose(0, 2, 1), normals)
        unit: NDArray[np.float64] = local / np.linalg.norm(local, axis=1, keepdims=True)
        return unit

    def _of(self, rows: NDArray[np.int64]) -> NDArray[np.float64]:
        return self.matrices if len(self.matrices) == 1 else self.matrices[rows]


def blended(
    bones: NDArray[np.float64], joints: NDArray[np.int64], weights: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(n, 3, 4) maps of linear blend skinning.

    Weights are divided by the sum of their sizes, as viewers do it (a file may have negative ones);
    a vertex without any follows its first joint alone.

    Args:
        bones: (j, 4, 4) from the mesh in its bind pose to world, for each joint of the skin.
        joints: (n, c) which of them a vertex follows.
        weights: (n, c) how much.
    """
    # In the order of the joints, so that seams whose halves list them otherwise stay welded.
    order = np.argsort(joints, axis=1, kind="stable")
    unweighted = ~(weights != 0).any(axis=1)
    weights = weights.copy()
    weights[unweighted, 0] = 1.0
    joints = np.take_along_axis(joints, order, axis=1)
    weights = np.take_along_axis(weights, order, axis=1)
    weights /= np.abs(weights).sum(axis=1, keepdims=True)
    maps = np.zeros((len(joints), 3, 4))
    for column in range(joints.shape[1]):
        maps += weights[:, column, None, None] * bones[joints[:, column], :3]
    return maps


def _turned(linear: NDArray[np.float64], vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """(k, 3) vectors under the linear parts of (k or 1, 3, 3 or 4) maps."""
    x, y, z = vectors[:, 0:1], vectors[:, 1:2], vectors[:, 2:3]
    turned: NDArray[np.float64] = x * linear[:, :, 0] + y * linear[:, :, 1] + z * linear[:, :, 2]
    return turned


def _cofactors(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    a, b, c = linear[:, :, 0], linear[:, :, 1], linear[:, :, 2]
    return np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=2)
