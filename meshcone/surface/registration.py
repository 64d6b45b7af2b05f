"""Registration of two surfaces without known correspondence.

Two stages. Many coarse starts run trimesh's iterative closest point (Besl & McKay 1992)
between point samples: it is cheap and finds the basin. It cannot finish the work: its
target is a cloud, so it stops a sample spacing short; with a free scale and matches in one
direction only it shrinks the source; and it has no weights for what one surface lacks.
The best candidates are therefore finished by Gauss–Newton steps on distances to the
tangent planes (Chen & Medioni 1992), matched both ways, with redescending weights.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from meshcone.deadline import require_time
from meshcone.surface.arrays import Floats, row_dot, row_lengths
from meshcone.surface.closest import SurfaceTree
from meshcone.surface.mesh import Mesh
from meshcone.surface.moments import Moments
from meshcone.surface.sampling import SurfaceSamples, sample_surface
from meshcone.surface.similarity import invert, scale_of, similarity, transform_points

_SAMPLES = 1500
_CLOUD = 4000
_COARSE_SAMPLES = 400
_COARSE_ITERATIONS = 12
_RANDOM_STARTS = 16
_TRIED_STARTS = 8
_TRIAL_ITERATIONS = 12
_FINE_ITERATIONS = 80
_SETTLED = 1e-7
# Fits are compared with every distance cut off here, relative to the reference's radius: how
# far off the parts are that one surface lacks must not decide.
_CUT_OFF = 0.1
# Matches farther than a few median distances count for little; the floor, relative to the
# reference's radius, keeps a perfect fit from discarding all matches but the exact ones.
_REACH_IN_MEDIANS = 3.0
_REACH_FLOOR = 1e-3
# A fit is as good as another up to so much of it, and of the reference's radius.
_NEARLY, _NEARLY_FLOOR = 1.1, 1e-4
# Thin and double shapes, and noise, turn some normals around; where more of them oppose each
# other, the outside of one is the other's inside. A few samples tell.
_OPPOSED = 0.6
_FEW = 32
# Some pull along the tangent plane keeps the steps bounded on symmetric shapes.
_TANGENTIAL = 0.03


@dataclass(frozen=True)
class Matches:
    """Closest points both ways between a moved source and the reference.

    Attributes:
        points: (2k, 3) on the moved source.
        targets: (2k, 3) on the reference; the first k were searched for, the others searched.
        normals: (2k, 3) of the reference at the targets.
    """

    points: Floats
    targets: Floats
    normals: Floats

    @cached_property
    def distances(self) -> Floats:
        """Distances of the matches by direction, (2, k)."""
        apart = row_lengths(self.points - self.targets)
        return np.asarray(apart.reshape(2, -1))

    def rms(self) -> float:
        """Root mean square of the distances in both directions."""
        return float(np.sqrt(np.mean(self.distances**2)))

    def misfit(self) -> float:
        """Return the same with every distance cut off, which parts that are missing leave alone."""
        return float(np.sqrt(np.mean(np.minimum(self.distances, _CUT_OFF) ** 2)))


class Registration:
    """Two surfaces prepared for registration.

    Args:
        source: the mesh to move.
        reference: the mesh to move it to, in its unit sphere.
        seed: of all samples and random starts.
    """

    def __init__(self, source: Mesh, reference: Mesh, seed: int) -> None:
        self._source_tree, self._reference_tree = SurfaceTree(source), SurfaceTree(reference)
        self._source = sample_surface(source, _CLOUD, seed)
        self._reference = sample_surface(reference, _CLOUD, seed + 1)
        self._seed = seed

    def matches(self, matrix: Floats, samples: int = _SAMPLES) -> Matches:
        """Match the source, moved by a (4, 4) similarity, with the reference."""
        moved = transform_points(matrix, self._source.points[:samples])
        forward = self._reference_tree.closest(moved)
        searched = self._reference.points[:samples]
        # The source's tree stays where it is: the reference's samples go to it instead.
        backward = self._source_tree.closest(transform_points(invert(matrix), searched))
        return Matches(
            points=np.concatenate([moved, transform_points(matrix, backward.points)]),
            targets=np.concatenate([forward.points, searched]),
            normals=np.concatenate(
                [
                    self._reference_tree.mesh.face_normals[forward.faces],
                    self._reference.normals[:samples],
                ]
            ),
        )

    def search(self, *, scaled: bool) -> Floats:
        """Find the (4, 4) rigid motion or, if ``scaled``, similarity of the best fit.

        The answer fits no worse than the identity.
        """
        coarse = sorted(self._coarse(scaled=scaled), key=self._cloud_distance)
        tried = [
            self._step(start, _TRIAL_ITERATIONS, _COARSE_SAMPLES, scaled=scaled)
            for start in (np.eye(4), *coarse[:_TRIED_STARTS])
        ]
        best = min(tried, key=lambda matrix: self.matches(matrix, _COARSE_SAMPLES).misfit())
        finished = self._step(best, _FINE_ITERATIONS, _SAMPLES, scaled=scaled)
        if turns_inside_out(finished, self._source, self._reference_tree):
            finished = self._less_turned(finished, scaled=scaled)
        return min([np.eye(4), finished], key=lambda matrix: self.matches(matrix).misfit())

    def finished(self, start: Floats) -> Floats:
        """Bring a (4, 4) similarity, which may mirror, from near the best fit to it."""
        return self._step(start, _TRIAL_ITERATIONS, _COARSE_SAMPLES, scaled=True)

    def _less_turned(self, found: Floats, *, scaled: bool) -> Floats:
        """Of a fit that turns over what is symmetric, one as good that turns less and not over.

        A tilted sheet fits after it is turned back, and after it is turned on and over.
        """
        moments = Moments.of(self._reference_tree.mesh)
        right_angles = Rotation.create_group("O").as_matrix()
        turns = (*right_angles, *(moments.axes @ right_angles @ moments.axes.T))
        others = [similarity(turn, 1.0, moments.centre, moments.centre) @ found for turn in turns]
        others.sort(key=_turn)
        misfit = self.matches(found, _COARSE_SAMPLES).misfit()
        for other in others:
            if _turn(other) >= _turn(found):
                break
            if turns_inside_out(other, self._source, self._reference_tree):
                continue
            if self.matches(other, _COARSE_SAMPLES).misfit() <= _NEARLY * misfit + _NEARLY_FLOOR:
                return self._step(other, _TRIAL_ITERATIONS, _SAMPLES, scaled=scaled)
        return found

    def _coarse(self, *, scaled: bool) -> list[Floats]:
        import trimesh  # half a second to import, and only this needs it

        samples = self._source.points[:_COARSE_SAMPLES]
        found = []
        for start in self._starts(scaled=scaled):
            require_time()
            matrix, _, _ = trimesh.registration.icp(
                samples,
                self._reference.points,
                initial=start,
                threshold=1e-7,
                max_iterations=_COARSE_ITERATIONS,
                reflection=False,
                scale=False,
            )
            found.append(np.asarray(matrix, dtype=np.float64))
        return found

    def _starts(self, *, scaled: bool) -> list[Floats]:
        """Turns by right angles about the world's and the principal axes, and random ones."""
        source, reference = self._source.points, self._reference.points
        centre, target = source.mean(axis=0), reference.mean(axis=0)
        spread = np.sqrt(np.mean((source - centre) ** 2))
        scale = float(np.sqrt(np.mean((reference - target) ** 2)) / spread) if scaled else 1.0
        right_angles = Rotation.create_group("O").as_matrix()
        random = Rotation.random(_RANDOM_STARTS, rng=np.random.default_rng(self._seed))
        principal = _principal_axes(reference) @ right_angles @ _principal_axes(source).T
        rotations = np.concatenate([right_angles, principal, random.as_matrix()])
        return [similarity(rotation, scale, centre, target) for rotation in rotations]

    def _cloud_distance(self, matrix: Floats) -> float:
        moved = transform_points(matrix, self._source.points[:_COARSE_SAMPLES])
        forward, _ = self._reference_cloud.query(moved)
        searched = transform_points(invert(matrix), self._reference.points[:_COARSE_SAMPLES])
        backward, _ = self._source_cloud.query(searched)
        distances = np.minimum(np.stack([forward, backward * scale_of(matrix)]), _CUT_OFF)
        return float(np.mean(distances**2))

    @cached_property
    def _source_cloud(self) -> cKDTree:
        return cKDTree(self._source.points)

    @cached_property
    def _reference_cloud(self) -> cKDTree:
        return cKDTree(self._reference.points)

    def _step(self, matrix: Floats, iterations: int, samples: int, *, scaled: bool) -> Floats:
        for _ in range(iterations):
            require_time()
            step = _gauss_newton_step(self.matches(matrix, samples), scaled=scaled)
            matrix = step @ matrix
            if np.abs(step - np.eye(4)).max() < _SETTLED:
                break
        return matrix


def turns_inside_out(matrix: Floats, samples: SurfaceSamples, reference: SurfaceTree) -> bool:
    """Whether a moved source's outside is the reference's inside.

    Args:
        matrix: (4, 4) similarity; what is outside stays outside after one that mirrors too.
        samples: of the source.
        reference: to which it is moved.
    """
    closest = reference.closest(transform_points(matrix, samples.points[:_FEW]))
    normals = samples.normals[:_FEW] @ matrix[:3, :3].T
    there = reference.mesh.face_normals[closest.faces]
    return bool(np.mean(row_dot(normals, there) < 0) > _OPPOSED)


def _turn(matrix: Floats) -> float:
    """By how much a (4, 4) similarity turns: 0 for none, 2 for half a turn."""
    return 1 - (float(np.trace(matrix[:3, :3])) / scale_of(matrix) - 1) / 2


def _principal_axes(points: Floats) -> Floats:
    """Return the (3, 3) right-handed frame of a cloud's principal axes, as columns."""
    _, axes = np.linalg.eigh(np.cov(points.T))
    axes[:, 0] *= np.sign(np.linalg.det(axes))
    return np.asarray(axes)


def _gauss_newton_step(matches: Matches, *, scaled: bool) -> Floats:
    """Return the (4, 4) similarity that best brings the matches together, to first order.

    Unknowns are a rotation vector ω, a translation t and a logarithm of scale σ, by which a
    point moves ω × p + t + σ p.
    """
    reach = _REACH_IN_MEDIANS * np.median(matches.distances, axis=1, keepdims=True) + _REACH_FLOOR
    weights = 1 / (1 + (matches.distances / reach) ** 2)  # square root of Geman & McClure's
    normals = matches.normals[:, :, None] * matches.normals[:, None, :]
    metric = np.sqrt(_TANGENTIAL) * np.eye(3) + (1 - np.sqrt(_TANGENTIAL)) * normals
    metric *= weights.reshape(-1, 1, 1)
    points = matches.points
    motions = np.zeros((len(points), 3, 7))
    for axis, unit in enumerate(np.eye(3)):
        motions[:, :, axis] = np.cross(unit, points)
        motions[:, axis, 3 + axis] = 1
    motions[:, :, 6] = points
    unknowns = 7 if scaled else 6
    system = (metric @ motions[:, :, :unknowns]).reshape(-1, unknowns)
    missing = (metric @ (matches.targets - points)[:, :, None]).ravel()
    solution = np.zeros(7)
    solution[:unknowns] = _solved(system.T @ system, system.T @ missing)
    rotation = Rotation.from_rotvec(solution[:3]).as_matrix()
    # A step of scale is bounded: far from the answer the linearisation promises too much.
    scale = float(np.exp(np.clip(solution[6], -0.2, 0.2)))
    return similarity(rotation, scale, np.zeros(3), solution[3:6])


def _solved(matrix: Floats, right: Floats) -> Floats:
    """Solve normal equations, which the tangential pull makes well conditioned."""
    try:
        return np.asarray(np.linalg.solve(matrix, right))
    except np.linalg.LinAlgError:  # all points on one line, about which a turn moves none
        return np.asarray(np.linalg.lstsq(matrix, right)[0])
