"""Scoring meshes against the one reference of a job, with the floor beside them."""

from __future__ import annotations

from meshcone.options import Options
from meshcone.quality.metrics import SampledSurface, compare
from meshcone.quality.records import Conventions, Metrics, Quality
from meshcone.surface import Mesh


class Scorer:
    """A reference, sampled once for all meshes it is compared with."""

    def __init__(self, reference: Mesh, options: Options) -> None:
        """Sample the reference; ``options.quality`` and ``options.seed`` are read."""
        self._options = options
        self._reference = self._sampled(reference, options.seed + 1)
        self.floor = compare(self._sampled(reference, options.seed), self._reference)

    def score(self, mesh: Mesh) -> Metrics:
        """Measure a mesh in the reference's frame."""
        return compare(self._sampled(mesh, self._options.seed), self._reference)

    def quality(self, before: Metrics, after: Metrics | None) -> Quality:
        """Put the metric sets beside the floor and the conventions."""
        chosen = self._options.quality
        return Quality(
            input=before,
            refined=after,
            floor=self.floor,
            conventions=Conventions(
                samples=chosen.samples,
                emd_samples=chosen.emd_samples,
                sampling="scrambled Sobol sequence on the area distribution",
                seed=self._options.seed,
            ),
        )

    def _sampled(self, mesh: Mesh, seed: int) -> SampledSurface:
        chosen = self._options.quality
        return SampledSurface.of(mesh, chosen.samples, chosen.emd_samples, seed)
