"""What a benchmark reads off a refined mesh, by the definitions of ``docs/metrics.md``."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from flips import FacingReference, flipped_faces

from meshcone.options import Options
from meshcone.quality.harm import HarmCheck
from meshcone.quality.intersections import self_intersections
from meshcone.quality.metrics import ClosestTriangles, aspect_ratio
from meshcone.quality.sampled import SampledSurface, Sampling
from meshcone.surface import Mesh

_SAMPLING = Sampling(samples=5000, emd_samples=0, curvature_samples=0)
# Not the options' default seed: the engine must not be measured where it looked itself.
_SEED = 20_000


@dataclass(frozen=True)
class Measures:
    """One mesh against the reference.

    Attributes:
        point_to_surface: mean of the two directed mean distances to the other's triangles.
        normals: mean absolute cosine with the closest triangle's normal, over samples of both.
        aspect_ratio: median over the faces.
    """

    point_to_surface: float
    normals: float
    aspect_ratio: float


class Yardstick:
    """A reference prepared for measuring meshes against it."""

    def __init__(self, reference: Mesh) -> None:
        self._reference = _sampled(reference)
        self._facing = FacingReference(self._reference.tree)
        self.tree = self._reference.tree
        self.aspect_ratio = aspect_ratio(reference).median

    def measure(self, mesh: Mesh) -> Measures:
        """Measure a mesh in the reference's frame; distances are in radii."""
        closest = ClosestTriangles.between(_sampled(mesh), self._reference)
        return Measures(
            point_to_surface=closest.point_to_surface().mean,
            normals=closest.normal_consistency(),
            aspect_ratio=aspect_ratio(mesh).median,
        )

    def flipped(self, before: Mesh, after: Mesh) -> int:
        """Count the faces turned against the reference."""
        return flipped_faces(before, after, self._facing)

    def crossings(self, before: Mesh, after: Mesh) -> int | None:
        """Count the pairs of faces that pass through each other now and did not before.

        None where there are too many pairs to test.
        """
        most = Options().quality.intersection_pairs
        then, now = (self_intersections(mesh, most) for mesh in (before, after))
        if then is None or now is None:
            return None
        known, found = (pairs[:, 0] * len(before.faces) + pairs[:, 1] for pairs in (then, now))
        return int(np.count_nonzero(~np.isin(found, known)))

    def harm(self, before: Mesh, after: Mesh) -> tuple[str, ...]:
        """Say in what a mesh with the same faces is worse than before, a clause each."""
        pairs = Options().quality.intersection_pairs
        check = HarmCheck(before, self._reference.mesh, self.tree, pairs)
        return tuple(check.objections(after.vertices))


def usable(mesh: Mesh) -> bool:
    """Whether a mesh can be measured: finite and with some area."""
    return bool(np.isfinite(mesh.vertices).all() and mesh.face_areas.sum() > 0)


def _sampled(mesh: Mesh) -> SampledSurface:
    return SampledSurface(mesh, _SAMPLING, _SEED)
