"""Distances each way apart: what a mesh lacks of its reference, and what it has besides."""

from __future__ import annotations

import numpy as np

from meshcone.quality.records import Directed, Directions, Histogram, SignedDistances
from meshcone.quality.sampled import SampledSurface
from meshcone.surface import Frame, Mesh
from meshcone.surface.arrays import Bools, Floats

BINS = 64
_PERCENT, _PERMILLE = 1e-2, 1e-3
_ROUNDING = 1e-9


def directions(
    surface: SampledSurface,
    reference: SampledSurface,
    frame: Frame,
    bound: float | None,
    *,
    closed: bool,
) -> Directions:
    """Describe the distances between two surfaces, each way apart.

    Args:
        surface: the judged mesh, in the frame.
        reference: in the frame.
        frame: that leads back to model units.
        bound: relative to the radius; the share of the area beyond it is stated.
        closed: whether the reference has an inside.
    """
    extra = surface.closest_on(reference).distances
    missing = reference.closest_on(surface).distances
    samples = len(surface.samples.points)
    searched = len(reference.samples.points)
    return Directions(
        missing=directed(reference.points, missing, searched, frame, bound),
        extra=directed(surface.points, extra, samples, frame, bound),
        signed=signed_distances(extra[:samples], inside(surface.points[:samples], reference.mesh))
        if closed
        else None,
        histogram=histogram(missing[:searched], extra[:samples]),
    )


def directed(
    points: Floats, distances: Floats, samples: int, frame: Frame, bound: float | None
) -> Directed:
    """Describe the distances of some points.

    Args:
        points: (k, 3) samples first, then vertices, in the frame.
        distances: (k,) to the other surface.
        samples: how many of them are samples, which stand for equal areas.
        frame: that leads back to model units.
        bound: relative to the radius.
    """
    sampled = distances[:samples]
    worst = int(np.argmax(distances))
    x, y, z = map(float, frame.out_of(points[worst : worst + 1])[0])

    def beyond(limit: float) -> float:
        return float(np.mean(sampled > limit))

    return Directed(
        mean=float(sampled.mean()),
        rms=float(np.sqrt(np.mean(sampled**2))),
        p95=float(np.quantile(sampled, 0.95)),
        max=float(distances[worst]),
        at=(x, y, z),
        beyond_percent=beyond(_PERCENT),
        beyond_permille=beyond(_PERMILLE),
        beyond_bound=None if bound is None else beyond(bound),
    )


def signed_distances(distances: Floats, enclosed: Bools) -> SignedDistances:
    """Describe distances (k,) to a closed surface; those of enclosed points count negative."""
    signed = np.where(enclosed, -distances, distances)
    low, high = np.quantile(signed, [0.05, 0.95])
    return SignedDistances(mean=float(signed.mean()), p5=float(low), p95=float(high))


def inside(points: Floats, reference: Mesh) -> Bools:
    """(k,) which points a closed mesh encloses, however its faces are turned.

    By the generalised winding number (Jacobson, Kavan and Sorkine-Hornung 2013), summed over a
    hierarchy (Barill et al. 2018). Unlike the side of the closest face it is right where the
    closest point lies on an edge or a corner, and where parts of the mesh cross each other.
    """
    turns = reference.windings.winding_number(np.asarray(points))
    return np.asarray(np.abs(np.atleast_1d(turns)) > 0.5)


def histogram(missing: Floats, extra: Floats) -> Histogram:
    """Shares of samples by their distance, in bins up to the largest of either direction."""
    upper = max(float(found.max(initial=0.0)) for found in (missing, extra))
    upper = 0.0 if upper <= _ROUNDING else upper

    def shares(distances: Floats) -> tuple[float, ...]:
        if not len(distances):
            return ()
        # A range without width would be one around 0.
        counts, _ = np.histogram(distances, BINS, (0.0, upper or 1.0))
        return tuple((counts / len(distances)).tolist())

    return Histogram(upper=upper, missing=shares(missing), extra=shares(extra))
