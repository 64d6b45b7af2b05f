"""Distances, normals, curvature and element quality of a mesh against a reference.

Definitions are those of ``conventions.py`` and ``docs/metrics.md``; every number is relative
to the frame the two meshes are in, the reference's unit sphere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist

from meshcone.quality.curvature import BALL_RADIUS
from meshcone.quality.no_area import without_area
from meshcone.quality.records import AspectRatio, Metrics, PointToSurface, Validity
from meshcone.quality.sampled import SampledSurface
from meshcone.stopwatch import Stopwatch
from meshcone.surface import Mesh
from meshcone.surface.arrays import Floats, row_dot

FSCORE_THRESHOLD = 0.01
_SLIVER_ASPECT = 4.0


def compare(
    surface: SampledSurface,
    reference: SampledSurface,
    validity: Validity,
    watch: Stopwatch | None = None,
) -> Metrics:
    """Measure one surface against another.

    Args:
        surface: the measured mesh.
        reference: in its unit sphere, as the measured mesh.
        validity: what was counted on the measured mesh.
        watch: told how long each part takes.
    """
    watch = watch or Stopwatch()
    with watch.stage("closest_triangles"):
        closest = ClosestTriangles.between(surface, reference)
    with watch.stage("nearest_samples"):
        nearest = _NearestSamples.between(surface, reference)
    with watch.stage("curvature_error"):
        curvature = None if reference.mesh.is_points else curvature_error(surface, reference)
    with watch.stage("emd"):
        emd = earth_movers_distance(surface.matching, reference.matching)
    with watch.stage("aspect_ratio"):
        aspect = aspect_ratio(surface.mesh)
    return Metrics(
        point_to_surface=closest.point_to_surface(),
        chamfer=nearest.chamfer(),
        chamfer_l1=nearest.chamfer_l1(),
        hausdorff=nearest.hausdorff(),
        hausdorff95=nearest.hausdorff95(),
        normal_consistency=nearest.normal_consistency(),
        surface_normal_consistency=closest.normal_consistency(),
        normal_deviation_deg=closest.normal_deviation_deg(),
        curvature_error=curvature,
        fscore=nearest.fscore(),
        emd=emd,
        aspect_ratio=aspect,
        validity=validity,
    )


@dataclass(frozen=True)
class ClosestTriangles:
    """What points of either surface find on the other's triangles.

    Attributes:
        distances: of the samples of each surface, (k,) twice.
        chords: 2 sin(α/2) of the angles of the samples' normals with the triangles', up to
            sign, (k,) twice.
        farthest: the distance and place of the sample or vertex farthest from the other
            surface, of each surface. A vertex is where a spike is seen that no sample hits.
    """

    distances: tuple[Floats, Floats]
    chords: tuple[Floats, Floats]
    farthest: tuple[tuple[float, Floats], tuple[float, Floats]]

    @staticmethod
    def between(surface: SampledSurface, reference: SampledSurface) -> ClosestTriangles:
        """Search in both directions."""
        there, back = _search(surface, reference), _search(reference, surface)
        return ClosestTriangles(
            distances=(there[0], back[0]),
            chords=(there[1], back[1]),
            farthest=(there[2], back[2]),
        )

    def point_to_surface(self) -> PointToSurface:
        """Distances to the triangles themselves."""
        there, back = self.distances
        largest, place = max(self.farthest, key=lambda found: found[0])
        x, y, z = map(float, place)
        return PointToSurface(
            mean=float((there.mean() + back.mean()) / 2),
            rms=float(np.sqrt((np.mean(there**2) + np.mean(back**2)) / 2)),
            p95=float(np.quantile(np.concatenate([there, back]), 0.95)),
            max=largest,
            max_at=(x, y, z),
        )

    def normal_consistency(self) -> float:
        """Mean absolute cosine between normals."""
        return float(np.mean([np.mean(1 - chords**2 / 2) for chords in self.chords]))

    def normal_deviation_deg(self) -> float:
        """Mean angle between normals, up to sign."""
        angles = [2 * np.arcsin((chords / 2).clip(0, 1)).mean() for chords in self.chords]
        return float(np.degrees(np.mean(angles)))


def _search(
    surface: SampledSurface, target: SampledSurface
) -> tuple[Floats, Floats, tuple[float, Floats]]:
    samples = surface.samples
    found = surface.closest_on(target, first=len(samples.points))
    distances = surface.closest_on(target).distances
    worst = int(np.argmax(distances))
    return (
        found.distances,
        target.closest_normals.chords(samples.normals, found),
        (float(distances[worst]), surface.points[worst]),
    )


@dataclass(frozen=True)
class _NearestSamples:
    """What samples of either surface find among the other's; (k,) twice.

    Attributes:
        distances: to the nearest sample.
        cosines: absolute cosines of the normals of the two.
    """

    distances: tuple[Floats, Floats]
    cosines: tuple[Floats, Floats]

    @staticmethod
    def between(surface: SampledSurface, reference: SampledSurface) -> _NearestSamples:
        there, back = _nearest(surface, reference), _nearest(reference, surface)
        return _NearestSamples((there[0], back[0]), (there[1], back[1]))

    def chamfer(self) -> float:
        return float(sum(np.mean(found**2) for found in self.distances))

    def chamfer_l1(self) -> float:
        return float(sum(found.mean() for found in self.distances))

    def hausdorff(self) -> float:
        return float(max(found.max() for found in self.distances))

    def hausdorff95(self) -> float:
        return float(max(np.quantile(found, 0.95) for found in self.distances))

    def normal_consistency(self) -> float:
        return float(np.mean([cosines.mean() for cosines in self.cosines]))

    def fscore(self) -> float:
        precision, recall = (float(np.mean(found < FSCORE_THRESHOLD)) for found in self.distances)
        return 2 * precision * recall / (precision + recall) if precision + recall > 0 else 0.0


def _nearest(surface: SampledSurface, target: SampledSurface) -> tuple[Floats, Floats]:
    distances, nearest = target.sample_tree.query(surface.samples.points)
    normals = target.samples.normals[nearest]
    return np.asarray(distances), np.abs(row_dot(surface.samples.normals, normals))


def curvature_error(surface: SampledSurface, reference: SampledSurface) -> float:
    """Mean |H − H′| of points of either surface and their closest points on the other.

    H is the mean curvature over a ball; see ``curvature.py``. It is multiplied by the
    reference's radius, so that the error does not depend on the unit of length. Its sign
    depends on which side is outside: where most normals of the two meshes oppose each other,
    one of them is inside out, and its curvature is taken with the other sign.
    """
    if surface.mesh.equals(reference.mesh):  # two sets of samples of one curvature
        return 0.0
    length = reference.radius
    pairs = [
        _curvatures(surface, reference, BALL_RADIUS * length),
        _curvatures(reference, surface, BALL_RADIUS * length),
    ]
    agreement = sum(agreeing for _, _, agreeing in pairs)
    sign = -1.0 if agreement < 0 else 1.0
    errors = [np.abs(here - sign * there).mean() for here, there, _ in pairs]
    return float(length * np.mean(errors))


def _curvatures(
    surface: SampledSurface, target: SampledSurface, radius: float
) -> tuple[Floats, Floats, float]:
    """Curvatures here and there, and by how many more normals agree than oppose each other."""
    points = surface.curvature_points
    closest = surface.closest_on(target, first=len(points.points))
    agreeing = np.sign(row_dot(points.normals, target.mesh.face_normals[closest.faces])).sum()
    here = surface.own_curvatures(radius)
    return here, target.curvature.at(closest.points, radius), float(agreeing)


def earth_movers_distance(points: Floats, others: Floats) -> float:
    """Return the exact earth mover's distance of two equally large point sets (k, 3).

    min over bijections π of mean ‖a − π(a)‖, as a linear assignment problem.
    """
    costs = cdist(points, others)
    rows, columns = linear_sum_assignment(costs)
    return float(costs[rows, columns].mean())


def aspect_ratio(mesh: Mesh) -> AspectRatio:
    """Measure element shape: L_max · perimeter / (4√3 · area), 1 for an equilateral triangle.

    This is VTK's triangle aspect ratio. Faces without area have none: they are left out
    of mean and median and counted in the share of slivers.
    """
    sides = np.linalg.norm(mesh.corners - np.roll(mesh.corners, -1, axis=1), axis=2)
    flat = without_area(mesh)
    solid = ~flat
    ratios = (sides[solid].max(axis=1) * sides[solid].sum(axis=1)) / (
        4 * np.sqrt(3) * mesh.face_areas[solid]
    )
    slivers = np.count_nonzero(flat) + np.count_nonzero(ratios > _SLIVER_ASPECT)
    return AspectRatio(
        mean=float(ratios.mean()) if len(ratios) else 0.0,
        median=float(np.median(ratios)) if len(ratios) else 0.0,
        share_over_4=float(slivers / max(len(mesh.faces), 1)),
    )
