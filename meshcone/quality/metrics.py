"""Distances, normals and element quality of a mesh against a reference.

Definitions are those of ``docs/metrics.md``; every number is relative to the frame the
two meshes are in, the reference's unit sphere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial import KDTree
from scipy.spatial.distance import cdist

from meshcone.quality.records import AspectRatio, Metrics, PointToSurface
from meshcone.surface import Mesh, SurfaceSamples, SurfaceTree, sample_surface
from meshcone.surface.arrays import Floats, row_dot

FSCORE_THRESHOLD = 0.01
_SLIVER_ASPECT = 4.0


@dataclass(frozen=True)
class SampledSurface:
    """A mesh with the samples its metrics are taken from.

    Attributes:
        mesh: the surface.
        tree: closest points on it.
        samples: samples for distances and normals.
        matching: samples for the earth mover's distance.
    """

    mesh: Mesh
    tree: SurfaceTree
    samples: SurfaceSamples
    matching: SurfaceSamples

    @staticmethod
    def of(mesh: Mesh, samples: int, emd_samples: int, seed: int) -> SampledSurface:
        """Sample a mesh; the same seed on the same mesh gives the same samples."""
        return SampledSurface(
            mesh=mesh,
            tree=SurfaceTree(mesh),
            samples=sample_surface(mesh, samples, seed),
            matching=sample_surface(mesh, emd_samples, seed),
        )


def compare(surface: SampledSurface, reference: SampledSurface) -> Metrics:
    """Measure one surface against another."""
    to_reference = _Directed.between(surface.samples, reference)
    to_surface = _Directed.between(reference.samples, surface)
    both = (to_reference, to_surface)
    sample_means = [d.to_samples.mean() for d in both]
    return Metrics(
        point_to_surface=_point_to_surface(to_reference.to_surface, to_surface.to_surface),
        chamfer=float(sum(np.mean(d.to_samples**2) for d in both)),
        chamfer_l1=float(sum(sample_means)),
        hausdorff=float(max(d.to_samples.max() for d in both)),
        hausdorff95=float(max(np.quantile(d.to_samples, 0.95) for d in both)),
        normal_consistency=float(np.mean([d.sample_normals.mean() for d in both])),
        surface_normal_consistency=float(np.mean([d.surface_normals.mean() for d in both])),
        normal_deviation_deg=float(
            np.mean([np.degrees(np.arccos(d.surface_normals.clip(0, 1))).mean() for d in both])
        ),
        fscore=_fscore(*(float(np.mean(d.to_samples < FSCORE_THRESHOLD)) for d in both)),
        emd=earth_movers_distance(surface.matching.points, reference.matching.points),
        aspect_ratio=aspect_ratio(surface.mesh),
    )


@dataclass(frozen=True)
class _Directed:
    """What samples of one surface find on another, one row a sample."""

    to_samples: Floats
    sample_normals: Floats
    to_surface: Floats
    surface_normals: Floats

    @staticmethod
    def between(samples: SurfaceSamples, target: SampledSurface) -> _Directed:
        distances, nearest = KDTree(target.samples.points).query(samples.points)
        closest = target.tree.closest(samples.points)
        return _Directed(
            to_samples=np.asarray(distances),
            sample_normals=np.abs(row_dot(samples.normals, target.samples.normals[nearest])),
            to_surface=closest.distances,
            surface_normals=np.abs(
                row_dot(samples.normals, target.mesh.face_normals[closest.faces])
            ),
        )


def _point_to_surface(there: Floats, back: Floats) -> PointToSurface:
    return PointToSurface(
        mean=float((there.mean() + back.mean()) / 2),
        rms=float(np.sqrt((np.mean(there**2) + np.mean(back**2)) / 2)),
        p95=float(np.quantile(np.concatenate([there, back]), 0.95)),
        max=float(max(there.max(), back.max())),
    )


def _fscore(precision: float, recall: float) -> float:
    return 2 * precision * recall / (precision + recall) if precision + recall > 0 else 0.0


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
    flat = mesh.face_areas <= 1e-14 * sides.max(axis=1) ** 2
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
