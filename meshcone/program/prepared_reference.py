"""The reference with what every round asks of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from meshcone.surface import Mesh, SurfaceTree, sample_surface
from meshcone.surface.arrays import Floats
from meshcone.surface.ordering import spatial_order

# Samples of the reference: about as many again as the source has vertices while that is
# cheap, and fewer for dense meshes, whose edges are shorter than what is left to find.
_FEWEST_SAMPLES = 2000
_DENSE_FROM = 40_000


def sample_count(source_vertices: int) -> int:
    """Return how many samples of either surface pull."""
    return max(min(2 * source_vertices, _DENSE_FROM + source_vertices // 4), _FEWEST_SAMPLES)


@dataclass(frozen=True)
class PreparedReference:
    """The reference with what every round asks of it.

    Attributes:
        tree: closest points on it.
        points: (k, 3) samples of it: on its faces and at its vertices.
        normals: (k, 3) their normals.
        seed: of the samples.
    """

    tree: SurfaceTree
    points: Floats
    normals: Floats
    seed: int

    @staticmethod
    def of(reference: Mesh, source_vertices: int, seed: int) -> PreparedReference:
        """Sample the reference up to twice as densely as the source has vertices.

        Its own vertices are among the samples: they are where corners are.
        """
        count = sample_count(source_vertices)
        samples = sample_surface(reference, count, seed)
        chosen = reference.used_vertices
        if len(chosen) > count:
            chosen = np.random.default_rng(seed).choice(chosen, count, replace=False)
        points = np.concatenate([samples.points, reference.vertices[chosen]])
        normals = np.concatenate([samples.normals, reference.vertex_normals[chosen]])
        order = spatial_order(points)
        return PreparedReference(SurfaceTree(reference), points[order], normals[order], seed)
