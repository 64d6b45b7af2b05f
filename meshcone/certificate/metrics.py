"""Which of the report's metrics are found again, and which are not looked at."""

from __future__ import annotations

from meshcone.certificate.checks import Check
from meshcone.quality.metrics import ClosestTriangles
from meshcone.quality.sampled import SampledSurface
from meshcone.report.report import Report
from meshcone.report.scoring import sampling_of
from meshcone.surface import Mesh

# Another machine may find other principal axes of a symmetric shape, and draws other samples.
_AGREEMENT = 0.05
_ROUNDING = 1e-7
_LEFT_OUT = (
    "every other metric, outcome, colours, audits, changes, gates, warnings, what was not "
    "examined, and times: not checked"
)


def metrics_check(report: Report, refined: Mesh, reference: Mesh) -> Check:
    """Measure the distances of the refined mesh again, as the report's were.

    Args:
        report: whose ``quality.refined.point_to_surface`` is looked at.
        refined: as the refined file stores it, in the frame.
        reference: in the frame.
    """
    stated = report.quality.refined
    if stated is None:
        return Check("metrics", False, "the report states no metrics of the refined mesh")
    sampling, seed = sampling_of(report.options.quality), report.options.seed
    found = ClosestTriangles.between(
        SampledSurface(refined, sampling, seed), SampledSurface(reference, sampling, seed + 1)
    ).point_to_surface()
    for name in ("mean", "rms", "p95", "max"):
        now, then = getattr(found, name), getattr(stated.point_to_surface, name)
        if not abs(now - then) <= _AGREEMENT * now + _ROUNDING:
            words = f"point_to_surface.{name} is {now:.3g}, the report states {then:.3g}"
            return Check("metrics", False, words)
    words = f"point_to_surface of the refined file is as the report states; {_LEFT_OUT}"
    return Check("metrics", True, words)
