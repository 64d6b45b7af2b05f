"""Finding the motion after which two surfaces agree, if there is one.

This is a diagnosis and no alignment: most pairs agree after no motion at all, and are to be
told so in some tens of milliseconds. A surface's area-weighted moments give its centre, its
size and its principal axes; a similarity leaves the ratios of its principal moments alone. So
pairs whose ratios differ are done with at once. For the others the turns and mirrorings that
files suffer are tried: right angles about the axes of the world, those that bring principal
axes together, and what a fit finds from where the source is.

A symmetric shape agrees after many motions. The plainest is told: none of a turn, then one after
which both have the same outside, then the smallest.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from meshcone.surface.arrays import Floats
from meshcone.surface.closest import SurfaceTree
from meshcone.surface.mesh import Mesh
from meshcone.surface.moments import Moments
from meshcone.surface.registration import Registration, turns_inside_out
from meshcone.surface.sampling import SurfaceSamples, sample_surface
from meshcone.surface.similarity import invert, scale_of, similarity, transform_points

_SAMPLES = 1000
_FEW = 32
_TRIED = 3
_SEED = 0
# Principal moments of two tessellations or of a noisy copy of one shape differ by less.
_MOMENTS = 0.15
# Distances are relative to the reference's radius.
_NOTHING = 1e-6
_NEAR = 0.02  # 95 % of both surfaces must lie as near to the other
_EXACT = 1e-3
# The motion must leave no more than this share of the mean distance.
_LEFT = 0.1
_PROMISING = 0.5


@dataclass(frozen=True)
class Motion:
    """A similarity, perhaps with a mirroring, that brings the source onto the reference.

    Attributes:
        matrix: (4, 4) from the source to the reference, for column vectors.
        before: mean distance of samples of either surface to the other without it.
        after: the same with it.
        exact: whether no sample is left farther than .001 of the radius.
    """

    matrix: Floats
    before: float
    after: float
    exact: bool


class MotionSearch:
    """Two surfaces, prepared to be compared under motions.

    Args:
        source: of positive area, in the reference's frame.
        reference: of positive area, in its own frame, where its radius is 1.
        source_tree, reference_tree: of the two.
    """

    def __init__(
        self, source: Mesh, reference: Mesh, source_tree: SurfaceTree, reference_tree: SurfaceTree
    ) -> None:
        self._source, self._reference = source, reference
        self._source_tree, self._reference_tree = source_tree, reference_tree

    def find(self) -> Motion | None:
        """The plainest motion that explains how the surfaces differ.

        It must leave a tenth of their mean distance at most, and of that of their vertices, and
        95 % of both surfaces within 2 % of the radius of the other.
        """
        before = self._mean(np.eye(4))
        if before <= _NOTHING or not self._same_moments():
            return None
        candidates = [self._about_centres(linear) for linear in self._turns()]
        candidates.append(self._registration.finished(candidates[0]))
        rough = np.array([self._mean(matrix, _FEW) for matrix in candidates])
        close = rough <= min(2 * rough.min() + _NOTHING, _PROMISING * before)
        ordered = sorted(np.flatnonzero(close), key=lambda one: self._rank(candidates[one]))
        for number in ordered[:_TRIED]:
            motion = self._accepted(candidates[number], before)
            if motion is not None:
                return motion
        return None

    def replaced(self, found: Motion, matrix: Floats) -> Motion | None:
        """The same with a matrix of rounder numbers, if that explains as much."""
        distances = self._distances(matrix)
        if not self._explains(matrix, distances, found.before):
            return None
        motion = _motion(matrix, found.before, distances)
        return motion if motion.exact or not found.exact else None

    def _rank(self, matrix: Floats) -> tuple[bool, bool, bool, tuple[float, int, float]]:
        """What makes a motion less plain than another, what counts most first."""
        linear = matrix[:3, :3] / scale_of(matrix)
        turned = bool(np.abs(linear - np.eye(3)).max() > _NOTHING)
        mirrored = bool(np.linalg.det(linear) < 0)
        opposed = turns_inside_out(matrix, self._source_samples, self._reference_tree)
        return turned, opposed, mirrored, _plainness(linear)

    def _accepted(self, matrix: Floats, before: float) -> Motion | None:
        distances = self._distances(matrix)
        if not self._explains(matrix, distances, before):
            matrix = self._registration.finished(matrix)
            distances = self._distances(matrix)
        explains = self._explains(matrix, distances, before)
        return _motion(matrix, before, distances) if explains else None

    def _explains(self, matrix: Floats, distances: Floats, before: float) -> bool:
        most = np.quantile(distances, 0.95, axis=1).max()
        near = distances.mean() <= _LEFT * before and most <= _NEAR
        return bool(near and self._vertices_agree(matrix))

    def _vertices_agree(self, matrix: Floats) -> bool:
        """Whether the motion brings the vertices of both together too.

        The noise of a few flat faces is a tilt and a shift to all samples within them; their
        corners tell that it is none.
        """
        before = self._measured(np.eye(4), self._corners, self._searched_corners)
        after = self._measured(matrix, self._corners, self._searched_corners)
        return all(
            left.mean() <= max(_LEFT * was.mean(), _NOTHING)
            for was, left in zip(before, after, strict=True)
        )

    def _mean(self, matrix: Floats, samples: int = _SAMPLES) -> float:
        return float(self._distances(matrix, samples).mean())

    def _distances(self, matrix: Floats, samples: int = _SAMPLES) -> Floats:
        """(2, k) distances of the moved source's samples, and of the reference's."""
        points = (self._samples[:samples], self._searched[:samples])
        return np.stack(self._measured(matrix, *points))

    def _measured(self, matrix: Floats, here: Floats, there: Floats) -> tuple[Floats, Floats]:
        """Distances (n,) of the moved source's points to the reference, and (m,) of its to it."""
        moved, back = transform_points(matrix, here), transform_points(invert(matrix), there)
        scale = np.cbrt(abs(np.linalg.det(matrix[:3, :3])))
        return (
            self._reference_tree.closest(moved).distances,
            scale * self._source_tree.closest(back).distances,
        )

    @cached_property
    def _source_samples(self) -> SurfaceSamples:
        return sample_surface(self._source, _SAMPLES, _SEED)

    @property
    def _samples(self) -> Floats:
        return self._source_samples.points

    @cached_property
    def _searched(self) -> Floats:
        return sample_surface(self._reference, _SAMPLES, _SEED + 1).points

    @cached_property
    def _corners(self) -> Floats:
        return _some_vertices(self._source)

    @cached_property
    def _searched_corners(self) -> Floats:
        return _some_vertices(self._reference)

    @cached_property
    def _registration(self) -> Registration:
        return Registration(self._source, self._reference, _SEED)

    @cached_property
    def _moments(self) -> tuple[Moments, Moments]:
        return Moments.of(self._source), Moments.of(self._reference)

    def _same_moments(self) -> bool:
        source, reference = self._moments
        shares = [each.principal / each.principal.sum() for each in (source, reference)]
        return bool(np.abs(shares[0] - shares[1]).max() <= _MOMENTS)

    def _about_centres(self, linear: Floats) -> Floats:
        source, reference = self._moments
        scale = float(np.sqrt(reference.principal.sum() / source.principal.sum()))
        return similarity(linear, scale, source.centre, reference.centre)

    def _turns(self) -> list[Floats]:
        """Orthogonal matrices: none, right angles, mirrorings, those of principal axes."""
        turns = Rotation.create_group("O")
        right_angles = [np.round(turn.as_matrix()) for turn in turns]
        right_angles.sort(key=_plainness)
        mirrored = [turn @ np.diag([-1.0, 1.0, 1.0]) for turn in right_angles]
        source, reference = self._moments
        signs = [np.diag([x, y, z]) for x in (1.0, -1.0) for y in (1.0, -1.0) for z in (1.0, -1.0)]
        principal = [reference.axes @ sign @ source.axes.T for sign in signs]
        # Where two moments are equal, any axes in their plane are principal. Of the turns that
        # bring the third axis into its place the smallest turns nothing about it.
        single = [
            _smallest_turn(axis, sign * image)
            for axis, image in zip(source.axes.T, reference.axes.T, strict=True)
            for sign in (1.0, -1.0)
        ]
        return [*right_angles, *mirrored, *principal, *single]


def _some_vertices(mesh: Mesh) -> Floats:
    """At most _SAMPLES of the vertices that faces use, evenly spread over their order."""
    used = np.unique(mesh.faces)
    return mesh.vertices[used[:: -(-len(used) // _SAMPLES)]]


def _motion(matrix: Floats, before: float, distances: Floats) -> Motion:
    return Motion(matrix, before, float(distances.mean()), bool(distances.max() <= _EXACT))


def _smallest_turn(vector: Floats, image: Floats) -> Floats:
    """The (3, 3) rotation by the smallest angle that brings one unit vector (3,) to another."""
    half = vector + image
    length = np.linalg.norm(half)
    if length < _NOTHING:  # half a turn, about anything square to both
        across = np.linalg.svd(vector[None])[2][2]
        return np.asarray(2 * np.outer(across, across) - np.eye(3))
    half /= length
    # A half turn about the one and then about what lies midway.
    return np.asarray(
        (2 * np.outer(half, half) - np.eye(3)) @ (2 * np.outer(vector, vector) - np.eye(3))
    )


def _plainness(linear: Floats) -> tuple[float, int, float]:
    """Smaller turns first, then those about an axis of the world, then negative ones.

    It is the way back, which is positive then, that is told. A mirroring (3, 3) counts by how
    far it is from leaving all as it is, and then by the turn that is left after mirroring
    along X.
    """
    mirrored = np.linalg.det(linear) < 0
    turn = linear @ np.diag([-1.0, 1.0, 1.0]) if mirrored else linear
    vector = Rotation.from_matrix(turn).as_rotvec()
    oblique = int(np.count_nonzero(np.abs(vector) > 1e-9))
    return -round(float(np.trace(linear)), 6), oblique, float(vector.sum())
