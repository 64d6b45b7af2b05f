"""A far start brought near: the source stretched over the reference before the first round.

Closest points tell a mesh that is far from its reference, such as a ball that is to become a
mug, little of where it belongs: one side of it covers several parts and nothing reaches the
inside of others. Here masses are matched instead of points. Vertices carry equal mass and so
do samples of the reference; the entropic matching of least cost sends every vertex to the
mean of what it is matched with (Cuturi, "Sinkhorn distances", 2013), and the mesh follows as
far as its fairness lets it. That repeats with sharper matchings and softer meshes.

What comes out is a start and nothing more: the rounds that follow write their programs from
it as from any other.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import LinearOperator, cg

from meshcone.deadline import require_time
from meshcone.program.prepared_reference import PreparedReference
from meshcone.program.source_structure import SourceStructure
from meshcone.surface import Mesh, SurfaceSamples, sample_surface
from meshcone.surface.arrays import Floats, Ints

Singles = NDArray[np.float32]

# The fairness of each step, and how far its matching looks, in the reference's radius.
# Softer meshes and sharper matchings come closer, in folds that no later round takes out.
_FAIRNESS = (100.0, 50.0, 25.0)
_WIDEST, _NARROWEST = 0.2, 0.1
# Samples of either side that are matched: the matching costs their product.
_MATCHED = 1000
_SWEEPS = 8  # of Sinkhorn's iteration; each step starts from the potentials of the one before
# What opposed normals cost against a squared distance: they keep sides of a thin part apart.
_OPPOSED_COST = 0.03
_STAYING = 1e-3  # weight on the distance to the step before, which keeps the system definite
_BLOCK = 4096  # vertices whose costs are held at once
_REDUCTION, _ITERATIONS = 1e-4, 500
# Of more vertices the smooth systems take longer than all rounds together.
LARGEST = 50_000


def stretched(source: Mesh, reference: PreparedReference, structure: SourceStructure) -> Floats:
    """Stretch the source over the reference, (n, 3).

    Args:
        source: the input in the frame.
        reference: the prepared reference.
        structure: of the source: its Laplacian, and which way it faces.

    Raises:
        SolveTimeoutError: the time allowed is over.
    """
    samples = sample_surface(reference.tree.mesh, _MATCHED, reference.seed)
    matching = _Matching(samples, structure.orientation, len(source.vertices), reference.seed)
    positions = source.vertices
    for fairness, width in zip(_FAIRNESS, _widths(), strict=True):
        require_time()
        targets = matching.targets(source.moved_to(positions), width)
        positions = _pulled(positions, targets, structure.laplacian, fairness)
    return positions


def _widths() -> Floats:
    return np.geomspace(_WIDEST, _NARROWEST, len(_FAIRNESS))


class _Matching:
    """Vertices matched with samples, from one step to the next.

    The cost of a vertex x with normal n and a sample y with normal m is ‖x − y‖² + κ(1 − n·m).
    Costs are of single precision: they only say where a mesh is to start.
    """

    def __init__(
        self, samples: SurfaceSamples, orientation: float, vertices: int, seed: int
    ) -> None:
        self._points = samples.points.astype(np.float32)
        self._normals = (orientation * samples.normals).astype(np.float32)
        order = np.random.default_rng(seed).permutation(vertices)
        self._chosen = np.sort(order[:_MATCHED])
        self._potentials = np.zeros(len(self._points), dtype=np.float32)

    def targets(self, mesh: Mesh, width: float) -> Floats:
        """Return the mean of the samples each vertex is matched with, (n, 3)."""
        softness = np.float32(width**2)
        costs = self._costs(mesh, self._chosen)
        transposed = np.ascontiguousarray(costs.T)
        share = softness * np.float32(np.log(len(self._points)))
        others = softness * np.float32(np.log(len(self._chosen)))
        for _ in range(_SWEEPS):
            of_vertices = _soft_least(costs, self._potentials - share, softness)
            self._potentials = _soft_least(transposed, of_vertices - others, softness)
        count = len(mesh.vertices)
        blocks = [np.arange(low, min(low + _BLOCK, count)) for low in range(0, count, _BLOCK)]
        return np.concatenate([self._means(mesh, block, softness) for block in blocks])

    def _means(self, mesh: Mesh, vertices: Ints, softness: np.float32) -> Floats:
        shares = (self._potentials - self._costs(mesh, vertices)) / softness
        shares -= shares.max(axis=1, keepdims=True)
        np.exp(shares, out=shares)
        means = (shares @ self._points) / shares.sum(axis=1, keepdims=True)
        return np.asarray(means, dtype=np.float64)

    def _costs(self, mesh: Mesh, vertices: Ints) -> Singles:
        at = mesh.vertices[vertices].astype(np.float32)
        facing = mesh.vertex_normals[vertices].astype(np.float32)
        lengths = (at**2).sum(axis=1)[:, None] + (self._points**2).sum(axis=1)
        opposed = np.float32(_OPPOSED_COST) * (1 - facing @ self._normals.T)
        return np.asarray(lengths - 2 * at @ self._points.T + opposed)


def _soft_least(costs: Singles, potentials: Singles, softness: np.float32) -> Singles:
    """Return −ε log Σ_j exp((h_j − C_ij)/ε) for each row i, (k,)."""
    exponents = (potentials - costs) / softness
    top = exponents.max(axis=1, keepdims=True)
    np.exp(np.subtract(exponents, top, out=exponents), out=exponents)
    return np.asarray(-softness * (np.log(exponents.sum(axis=1)) + top[:, 0]))


def _pulled(
    positions: Floats, targets: Floats, laplacian: sparse.csr_array, fairness: float
) -> Floats:
    """Minimise Σ‖x − T‖² + λ Σ‖L x‖² + ε Σ‖x − x_before‖² over (n, 3) x."""
    smoothing = sparse.csr_array(laplacian.T @ laplacian)
    diagonal = 1 + _STAYING + fairness * smoothing.diagonal()
    system = (fairness * smoothing + (1 + _STAYING) * sparse.eye_array(len(positions))).tocsr()
    wanted = targets + _STAYING * positions
    scaling = LinearOperator(system.shape, matvec=lambda x: x / diagonal, dtype=np.float64)
    found = np.empty_like(positions)
    for axis in range(3):
        # A start need not be exact: the rounds that follow forget how it was found.
        found[:, axis], _ = cg(
            system,
            wanted[:, axis],
            x0=positions[:, axis],
            rtol=_REDUCTION,
            maxiter=_ITERATIONS,
            M=scaling,
            callback=lambda _: require_time(),
        )
    return found
