"""The paper's program: pull to the centroid, stay near X_ref, keep edges short.

    minimise ‖X − 1μᵀ‖² + λ‖X − X_ref‖²   subject to ‖X_i − X_j‖ ≤ δ on every edge

(section "Mathematical Formulation"). Its unconstrained optimum is X_ref shrunk by
λ/(1+λ) about μ; :meth:`CentroidObjective.undo_shrink` is the similarity that takes
that back, where the paper rescales its results into the unit sphere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from meshcone.options import Options
from meshcone.program.cones import EdgeCaps
from meshcone.surface import Mesh, sample_surface
from meshcone.surface.arrays import Floats


@dataclass(frozen=True)
class CentroidObjective:
    """‖X − 1μᵀ‖² + λ‖X − X_ref‖² as ½ xᵀP x + cᵀx + constant.

    Attributes:
        centroid: (3,) μ.
        anchor: (n, 3) X_ref.
        regularization: λ.
    """

    centroid: Floats
    anchor: Floats
    regularization: float

    @property
    def linear(self) -> Floats:
        """The vector c, (3n,)."""
        return np.asarray(-2 * (self.centroid + self.regularization * self.anchor)).ravel()

    @property
    def constant(self) -> float:
        """The objective's value at X = 0."""
        at_zero = len(self.anchor) * np.sum(self.centroid**2)
        return float(at_zero + self.regularization * np.sum(self.anchor**2))

    def matrix(self) -> sparse.csc_array:
        """Return P = 2(1 + λ) I."""
        diagonal = np.full(self.anchor.size, 2 * (1 + self.regularization))
        return sparse.diags_array(diagonal).tocsc()

    def apply(self, x: Floats) -> Floats:
        """Return P x."""
        return 2 * (1 + self.regularization) * x

    def unconstrained_optimum(self) -> Floats:
        """Return the closed form (μ + λ X_ref) / (1 + λ), (n, 3)."""
        blended = self.centroid + self.regularization * self.anchor
        return np.asarray(blended / (1 + self.regularization))

    @property
    def undo_scale(self) -> float:
        """The factor (1 + λ)/λ about μ by which the optimum is blown up again."""
        return (1 + self.regularization) / self.regularization

    def undo_shrink(self, positions: Floats) -> Floats:
        """Scale (n, 3) positions about μ by :attr:`undo_scale`."""
        return self.centroid + (positions - self.centroid) * self.undo_scale


def choose_anchor(source: Mesh, reference: Mesh) -> tuple[Floats, bool]:
    """Choose X_ref: the reference's vertices where both meshes have the same faces.

    The paper asks for equal vertex counts only, which scrambles the mesh when the
    orders differ; equal faces are what makes vertex i of one vertex i of the other.

    Returns:
        X_ref (n, 3), and whether it is the reference's.
    """
    same = len(source.vertices) == len(reference.vertices) and np.array_equal(
        source.faces, reference.faces
    )
    return (reference.vertices if same else source.vertices), same


def centroid_program(
    source: Mesh, reference: Mesh, options: Options
) -> tuple[CentroidObjective, EdgeCaps, bool]:
    """Write the paper's program; the third value says whether it is anchored at the reference."""
    chosen = options.centroid
    samples = sample_surface(reference, chosen.samples, options.seed, method="random")
    anchor, copied = choose_anchor(source, reference)
    objective = CentroidObjective(samples.points.mean(axis=0), anchor, chosen.regularization)
    return objective, EdgeCaps.uniform(source, chosen.edge_cap), copied
