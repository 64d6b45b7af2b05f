"""Every report says what the whole assets are, and what else changed between them."""

from __future__ import annotations

import json
from typing import Any

import pytest

from meshcone.files import MeshFile
from meshcone.options import parse_options
from meshcone.report.reading import parse_report
from meshcone.report.report import MeasureReport, Report
from meshcone.verbs.measure import measure
from meshcone.verbs.refine import refine
from tests import shapes
from tests.whole_asset import whole

FEW: dict[str, Any] = {
    "effort": "fast",
    "quality": {"samples": 64, "emd_samples": 16, "curvature_samples": 16},
}


def ball(levels: int = 1) -> MeshFile:
    return MeshFile("ball.obj", shapes.obj(*shapes.sphere(levels)))


def measured(source: MeshFile, reference: MeshFile, **options: Any) -> MeasureReport:
    return measure(source, reference, parse_options({**FEW, **options}))


def refined(source: MeshFile, reference: MeshFile) -> Report:
    return refine(source, reference, parse_options(FEW)).report


def test_a_measurement_says_what_both_assets_are() -> None:
    asset = measured(ball(1), ball(2)).asset

    assert asset is not None
    assert asset.reference is not None
    assert (asset.source.budget.triangles, asset.reference.budget.triangles) == (32, 128)
    assert asset.refined is None


def test_a_refinement_says_what_came_of_the_source_too() -> None:
    vertices, faces = shapes.sphere(1)
    small = MeshFile("small.obj", shapes.obj(0.9 * vertices, faces))

    report = refined(small, ball(2))

    assert report.asset is not None
    assert report.asset.refined is not None
    assert report.asset.refined.budget.file_bytes == report.output.bytes
    assert report.asset.refined.size.height > report.asset.source.size.height
    assert report.asset.refined.geometry.volume != report.asset.source.geometry.volume


def test_what_the_source_lacks_is_told_as_lost() -> None:
    document = whole()
    reference = MeshFile("a.gltf", document.to_bytes())
    del document.json["animations"]

    changes = measured(MeshFile("b.gltf", document.to_bytes()), reference).changes

    assert changes is not None
    assert changes.lost.animations == 1
    assert [row.what for row in changes.rows] == ["animations"]


def test_a_report_can_be_had_without_any_of_it() -> None:
    report = measured(ball(), ball(), audit=False)

    assert report.asset is None
    assert report.changes is None


@pytest.mark.parametrize("field", ["asset", "changes"])
def test_a_report_is_read_as_it_was_written(field: str) -> None:
    report = refined(ball(), ball(2))

    again = parse_report(report.model_dump_json().encode())

    assert getattr(again, field) == getattr(report, field)
    assert again == report


def test_a_report_of_the_version_before_is_still_read() -> None:
    report = refined(ball(), ball(2))
    document = json.loads(report.model_dump_json())
    for added in ("mode", "asset", "changes"):
        del document[added]
    del document["timings"]["audit"]
    del document["options"]["audit"]
    document["schema"] = "meshcone.report/1"

    again = parse_report(json.dumps(document).encode())

    assert again.asset is None
    assert again.quality == report.quality
    assert again.options == report.options
