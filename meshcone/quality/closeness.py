"""Distances between a mesh and its reference at places that stay the same while it moves."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from meshcone.surface import Mesh, SurfaceTree, sample_surface
from meshcone.surface.arrays import Floats, Ints
from meshcone.surface.closest import barycentric_weights

_SAMPLES = 8000
_SEED = 2**31 + 11  # options allow seeds up to 2³¹ − 1: no caller's samples are these


@dataclass(frozen=True)
class Distances:
    """Of samples, in both directions; relative to the radius.

    Attributes:
        sampled: (2, k) of each sample, from the mesh and from the reference.
    """

    mean: float
    p95: float
    max: float
    sampled: Floats = field(repr=False, compare=False)


@dataclass(frozen=True)
class Gain:
    """How much closer an answer is than its input, over the same places on both.

    Attributes:
        mean: of the differences, relative to the radius; negative where it is farther away.
        error: standard error of that mean over the samples.
    """

    mean: float
    error: float


@dataclass(frozen=True)
class Probes:
    """Places on a source and on its reference where distances are measured.

    Attributes:
        points: (k, 3) on the reference.
        faces: (k,) of the source.
        weights: (k, 3) where on these.
    """

    points: Floats
    faces: Ints
    weights: Floats

    @staticmethod
    def of(source: Mesh, reference: Mesh) -> Probes:
        """Draw places on both by area."""
        points = sample_surface(reference, _SAMPLES, _SEED).in_space().points
        drawn = sample_surface(source, _SAMPLES, _SEED + 1).in_space()
        weights = barycentric_weights(drawn.points, source, drawn.faces)
        return Probes(points, drawn.faces, weights)

    def measured(self, mesh: Mesh, tree: SurfaceTree) -> Distances:
        """Measure the distances of a mesh with the source's faces from the reference's tree."""
        # The same places on the mesh before and after: areas change, and a part that the
        # reference lacks would weigh more beside one that has become smooth.
        corners = mesh.vertices[mesh.faces[self.faces]]
        carried = np.einsum("ij,ijk->ik", self.weights, corners)
        there = tree.closest(carried).distances
        back = SurfaceTree(mesh).closest(self.points).distances
        return Distances(
            mean=float((there.mean() + back.mean()) / 2),
            p95=float(max(np.quantile(there, 0.95), np.quantile(back, 0.95))),
            max=float(max(there.max(), back.max())),
            sampled=np.stack([there, back]),
        )
