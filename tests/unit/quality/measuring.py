"""Metrics of meshes the tests make, with few samples."""

from __future__ import annotations

from meshcone.quality.metrics import compare
from meshcone.quality.records import Metrics
from meshcone.quality.sampled import SampledSurface, Sampling
from meshcone.quality.validity import inspect
from meshcone.surface import Frame, Mesh

FEW = Sampling(samples=2000, emd_samples=128, curvature_samples=256)
PAIRS = 100_000


def sampled(mesh: Mesh, seed: int = 0, sampling: Sampling = FEW) -> SampledSurface:
    return SampledSurface(mesh, sampling, seed)


def metrics(mesh: Mesh, reference: Mesh) -> Metrics:
    return compare(sampled(mesh, 0), sampled(reference, 1), inspect(mesh, PAIRS))


def framed_metrics(mesh: Mesh, reference: Mesh) -> Metrics:
    """Metrics in the reference's frame, as a report states them."""
    frame = Frame.of(reference)
    return metrics(*(each.moved_to(frame.into(each.vertices)) for each in (mesh, reference)))
