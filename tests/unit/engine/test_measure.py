"""What a measurement reports: metrics, their floor, and what they mean."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from meshcone.errors import InputError
from meshcone.files import MeshFile
from meshcone.options import Options, parse_options
from meshcone.quality.records import Metrics
from meshcone.report.report import MeasureReport
from meshcone.verbs.measure import measure
from tests import shapes
from tests.unit.engine.pairs import rough, smooth

FEW: dict[str, Any] = {"quality": {"samples": 1000, "emd_samples": 64, "curvature_samples": 64}}


def report(source: MeshFile, reference: MeshFile, **options: Any) -> MeasureReport:
    return measure(source, reference, parse_options({**FEW, **options}))


def test_a_mesh_against_itself_is_at_the_floor() -> None:
    ball = smooth()

    found = report(ball, ball)

    quality = found.quality
    assert found.outcome == "indistinguishable"
    assert quality.input.point_to_surface.max <= 1e-9
    assert quality.input.surface_normal_consistency == pytest.approx(1, abs=1e-12)
    assert quality.input == quality.floor


def test_a_mesh_against_another_is_different() -> None:
    found = report(rough(), smooth())

    assert found.outcome == "different"
    assert found.quality.input.chamfer > found.quality.floor.chamfer
    assert found.quality.refined is None


def test_the_floor_compares_two_independent_sets_of_samples() -> None:
    floor = report(rough(), smooth()).quality.floor

    assert floor.chamfer > 0
    assert floor.emd > 0


@pytest.mark.parametrize("sampling", ["sobol", "random"])
def test_every_metric_says_what_it_is_and_how_it_was_sampled(sampling: str) -> None:
    options = {"quality": {**FEW["quality"], "sampling": sampling}, "seed": 5}

    conventions = report(rough(), smooth(), **options).quality.conventions

    assert conventions.metrics.keys() == {*Metrics.model_fields, "color_difference", "deviation"}
    for name, samples in {"chamfer": 1000, "emd": 64, "curvature_error": 64}.items():
        found = conventions.metrics[name]
        assert (found.samples, found.seed, found.reference_seed) == (samples, 5, 6)
    assert conventions.metrics["aspect_ratio"].samples is None
    assert ("Sobol" in conventions.sampling) == (sampling == "sobol")


def test_the_paper_is_sampled_as_it_says() -> None:
    options = parse_options({"preset": "paper"})

    assert options.quality.sampling == "random"
    assert (options.quality.samples, options.quality.emd_samples) == (5000, 5000)
    assert (options.formulation, options.centroid.samples) == ("centroid", 10_000)


def test_what_is_set_beside_a_preset_holds() -> None:
    options = parse_options({"preset": "paper", "quality": {"samples": 100}})

    assert (options.quality.samples, options.quality.emd_samples) == (100, 5000)
    assert Options.model_validate_json(options.model_dump_json()) == options


@pytest.mark.parametrize("document", [{"preset": "papers"}, {"preset": "paper", "quality": 3}])
def test_a_preset_hides_no_mistake(document: dict[str, Any]) -> None:
    with pytest.raises(InputError):
        parse_options(document)


def test_baselines_are_scored_where_asked_for() -> None:
    quality = report(rough(), smooth(), baselines=True).quality

    assert report(rough(), smooth()).quality.baselines is None
    assert quality.baselines is not None
    closest, smoothed = quality.baselines.closest_point, quality.baselines.laplacian
    assert closest.point_to_surface.mean < quality.input.point_to_surface.mean
    assert smoothed.point_to_surface.mean > closest.point_to_surface.mean  # it shrinks
    assert closest.validity.flipped_faces is not None


def test_defects_are_the_same_wherever_they_are_told() -> None:
    vertices, faces = shapes.sphere(2)
    broken = MeshFile("broken.obj", shapes.obj(vertices, np.concatenate([faces, faces[:1]])))

    found = report(broken, smooth())

    assert found.inputs.source.validity == found.quality.input.validity
    assert found.inputs.reference.validity == found.quality.floor.validity
    assert found.quality.input.validity.duplicate_faces == 1
    assert any("1 face with the same corners" in warning.words for warning in found.warnings)


def test_intersections_beyond_the_bound_are_not_tested() -> None:
    options = {"quality": {**FEW["quality"], "intersection_pairs": 10}}

    found = report(rough(), smooth(), **options)

    assert found.inputs.source.validity.self_intersections is None
    assert report(rough(), smooth()).inputs.source.validity.self_intersections == 0


def test_timings_say_what_the_metrics_took() -> None:
    timings = report(rough(), smooth()).timings

    parts = {"sampling", "closest_triangles", "nearest_samples", "curvature_error", "emd"}
    assert timings.metrics.keys() >= parts | {"aspect_ratio", "validity"}
    assert sum(timings.metrics.values()) <= timings.quality


def test_faces_whose_corners_coincide_are_counted_on_either_side() -> None:
    """The weld drops them; the report, and a gate on it, must not."""
    text = smooth().data
    spoiled = MeshFile("spoiled.obj", text + b"f 1 1 2\nf 3 4 3\n")
    clean = MeshFile("clean.obj", text)

    found = report(spoiled, clean)
    assert found.inputs.source.faces == found.inputs.reference.faces + 2
    assert found.quality.input.validity.degenerate_faces == 2
    assert found.quality.floor.validity.degenerate_faces == 0
    assert report(clean, spoiled).quality.floor.validity.degenerate_faces == 2
