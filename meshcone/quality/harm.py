"""Whether an answer is worse than its input anywhere it counts.

A mean over samples can fall while one corner is torn off, faces turn over or pass through
each other. So an answer is held against its input on several counts at once, over samples
drawn with seeds that nothing else uses: what was minimised must not be its own judge.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from meshcone.quality.cracks import count_cracks
from meshcone.quality.intersections import count_self_intersections
from meshcone.surface import Mesh, SurfaceTree, sample_surface
from meshcone.surface.arrays import Floats, row_dot
from meshcone.surface.closest import barycentric_weights

_SAMPLES = 8000
_SEED = 2**31 + 11  # options allow seeds up to 2³¹ − 1: no caller's samples are these
# Distances may grow by this share and this much of the radius: what samples cannot tell apart.
_MEAN_SHARE, _P95_SHARE, _MAX_SHARE = 0.005, 0.02, 0.02
_P95_ROUNDING, _MAX_ROUNDING = 1e-3, 1e-4
# Defects of the mesh itself may grow by this many, of a small mesh by fewer, or by this share
# of its faces; by more only where the mean distance falls to a quarter.
_FEWEST_DEFECTS, _FEW_SHARE = 4, 0.05
_DEFECT_SHARE, _SHARE_IF_MUCH_CLOSER, _MUCH_CLOSER = 0.005, 0.05, 0.25


@dataclass(frozen=True)
class _Distances:
    """Of samples and vertices, in both directions; relative to the radius."""

    mean: float
    p95: float
    max: float


class HarmCheck:
    """A source and its reference, prepared to be held against answers.

    Args:
        source: in the reference's frame.
        reference: in its own frame.
        tree: closest points on the reference.
        intersection_pairs: pairs of faces that may be tested for self-intersections.
        distances: whether it counts that an answer is farther from the reference.
    """

    def __init__(
        self,
        source: Mesh,
        reference: Mesh,
        tree: SurfaceTree,
        intersection_pairs: int,
        *,
        distances: bool = True,
    ) -> None:
        self._distances_count = distances
        self._source, self._tree, self._pairs = source, tree, intersection_pairs
        self._targets = np.concatenate(
            [
                sample_surface(reference, _SAMPLES, _SEED).points,
                reference.vertices[reference.used_vertices],
            ]
        )
        drawn = sample_surface(source, _SAMPLES, _SEED + 1)
        self._faces = drawn.faces
        self._weights = barycentric_weights(drawn.points, source, drawn.faces)
        self._input = self._distances(source)

    @property
    def input_distance(self) -> float:
        """The mean distance of the input from the reference, both ways, in its radius."""
        return self._input.mean

    def comes_closer(self, positions: Floats) -> bool:
        """Tell whether the mean distance of the source at (n, 3) positions is the smaller one."""
        return self._distances(self._source.moved_to(positions)).mean < self._input.mean

    def objections(self, positions: Floats) -> list[str]:
        """Say in what the source at (n, 3) positions is worse than the source, a clause each."""
        mesh = self._source.moved_to(positions)
        was, now = self._input, self._distances(mesh)
        found = [
            f"{what} distance grows from {before:.3g} to {after:.3g} of the radius"
            for what, before, after, share, rounding in (
                ("the mean", was.mean, now.mean, _MEAN_SHARE, 0.0),
                ("the 95th percentile of the", was.p95, now.p95, _P95_SHARE, _P95_ROUNDING),
                ("the largest", was.max, now.max, _MAX_SHARE, _MAX_ROUNDING),
            )
            if self._distances_count and after > (1 + share) * before + rounding
        ]
        much_closer = now.mean <= _MUCH_CLOSER * was.mean
        share = _SHARE_IF_MUCH_CLOSER if much_closer else _DEFECT_SHARE
        few = min(_FEWEST_DEFECTS, int(_FEW_SHARE * len(mesh.faces)))
        return found or self._defects(mesh, max(few, int(share * len(mesh.faces))))

    def _defects(self, mesh: Mesh, allowed: int) -> list[str]:
        found = []
        turned = self._opposed(mesh) - self._opposed(self._source)
        if turned > allowed:
            found.append(f"{turned:,} more faces turn their backs on the reference")
        more = self._more_crossing(mesh)
        # Where the reference's own faces pass through each other, so will those that follow it.
        if more > allowed and more > self._crossing_of_reference - (self._crossing or 0):
            found.append(f"{more:,} more pairs of faces pass through each other")
        torn, was = count_cracks(mesh, self._pairs), count_cracks(self._source, self._pairs)
        if torn is not None and was is not None and torn - was > allowed:
            found.append(f"{torn - was:,} more edges of open borders lie along another border")
        return found

    def _more_crossing(self, mesh: Mesh) -> int:
        """Count the pairs of faces that pass through each other beyond the input's."""
        crossed, crossing = count_self_intersections(mesh, self._pairs), self._crossing
        return 0 if crossed is None or crossing is None else crossed - crossing

    @cached_property
    def _crossing(self) -> int | None:
        return count_self_intersections(self._source, self._pairs)

    @cached_property
    def _crossing_of_reference(self) -> int:
        return count_self_intersections(self._tree.mesh, self._pairs) or 0

    @cached_property
    def _orientation(self) -> float:
        return 1.0 if np.mean(self._agreement(self._source)) >= 0 else -1.0

    def _distances(self, mesh: Mesh) -> _Distances:
        # The same places on the mesh before and after: areas change, and a part that the
        # reference lacks would weigh more beside one that has become smooth.
        carried = np.einsum("ij,ijk->ik", self._weights, mesh.corners[self._faces])
        there = self._tree.closest(carried).distances
        corners = self._tree.closest(mesh.vertices[mesh.used_vertices]).distances
        back = SurfaceTree(mesh).closest(self._targets).distances
        sampled = back[:_SAMPLES]
        return _Distances(
            mean=float((there.mean() + sampled.mean()) / 2),
            p95=float(max(np.quantile(there, 0.95), np.quantile(sampled, 0.95))),
            max=float(max(there.max(), corners.max(), back.max())),
        )

    def _opposed(self, mesh: Mesh) -> int:
        return int(np.count_nonzero(self._orientation * self._agreement(mesh) < 0))

    def _agreement(self, mesh: Mesh) -> Floats:
        """Return the cosine between each face and the closest face of the reference, (m,)."""
        closest = self._tree.closest(mesh.corners.mean(axis=1))
        return row_dot(mesh.face_normals, self._tree.mesh.face_normals[closest.faces])
