from __future__ import annotations

import pytest

from meshcone.files import MeshFile
from meshcone.options import Options
from meshcone.report.report import MeasureReport
from meshcone.verbs.measure import measure
from tests import shapes
from worker.jobs.summaries import JobSummary


def measured(gates: dict[str, dict[str, float]]) -> MeasureReport:
    vertices, faces = shapes.sphere(2)
    source = MeshFile("rough.obj", shapes.obj(shapes.noisy(vertices), faces))
    reference = MeshFile("ball.obj", shapes.obj(vertices, faces))
    return measure(source, reference, Options.model_validate({"gates": gates}))


def test_a_summary_states_what_the_report_states() -> None:
    report = measured({})
    summary = JobSummary.of(report)

    assert summary.outcome == "different"
    assert summary.metrics["point_to_surface.max"] == report.quality.input.point_to_surface.max
    assert summary.metrics == summary.input
    assert summary.radius == pytest.approx(2.0)
    assert summary.worst is None


def test_the_worst_check_is_the_one_nearest_to_its_bound() -> None:
    report = measured({"fscore": {"min": 1e-6}, "emd": {"max": 0.9}, "hausdorff": {"max": 0.5}})
    summary = JobSummary.of(report)

    assert summary.worst is not None
    assert (summary.worst.key, summary.worst.status) == ("hausdorff", "pass")


def test_a_failed_check_is_worse_than_any_that_passed() -> None:
    summary = JobSummary.of(measured({"hausdorff": {"max": 0.5}, "fscore": {"min": 0.9999}}))

    assert summary.worst is not None
    assert (summary.worst.key, summary.worst.status) == ("fscore", "fail")
