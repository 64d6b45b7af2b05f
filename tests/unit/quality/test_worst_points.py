"""The places where two surfaces are farthest apart."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.files import MeshFile
from meshcone.options import QualityOptions, parse_options
from meshcone.quality.records import Quality
from meshcone.verbs.measure import measure
from tests import shapes

RADIUS = 2.0  # of the reference, in model units
QUICK = QualityOptions(samples=1000, emd_samples=64)


def quality(vertices: np.ndarray, faces: np.ndarray) -> Quality:
    ball = MeshFile("ball.obj", shapes.obj(*shapes.sphere(3, RADIUS)))
    options = parse_options({}).model_copy(update={"quality": QUICK})
    return measure(MeshFile("source.obj", shapes.obj(vertices, faces)), ball, options).quality


def test_each_spike_is_found_once_and_the_highest_first() -> None:
    vertices, faces = shapes.sphere(4, RADIUS)  # whose faces are small, and spikes thin
    spikes = {10: 0.12, 60: 0.2, 200: 0.16}  # vertices and heights in model units
    for vertex, height in spikes.items():
        vertices[vertex] *= 1 + height / RADIUS

    worst = quality(vertices, faces).worst_points

    first, second, third, *_ = (each for each in worst if each.on == "mesh")
    for found, vertex in ((first, 60), (second, 200), (third, 10)):
        assert found.position == pytest.approx(tuple(vertices[vertex]), abs=1e-6)
        assert found.distance * RADIUS == pytest.approx(spikes[vertex], rel=0.05)


def test_what_the_mesh_lacks_is_a_point_of_the_reference() -> None:
    vertices, faces = shapes.sphere(3, RADIUS)
    cap = vertices[:, 2] > 1.2
    kept = faces[~cap[faces].all(axis=1)]

    worst = quality(vertices, kept).worst_points[0]

    assert worst.on == "reference"
    assert worst.position == pytest.approx((0, 0, RADIUS), abs=0.05)


def test_the_worst_is_the_place_of_the_largest_deviation() -> None:
    vertices, faces = shapes.sphere(3, RADIUS)
    found = quality(shapes.noisy(vertices), faces)

    worst, largest = found.worst_points[0], found.input.point_to_surface
    distance = np.linalg.norm(np.subtract(worst.position, worst.closest)) / RADIUS
    assert worst.distance == pytest.approx(largest.max)
    assert worst.distance == pytest.approx(distance)
    assert np.array(worst.position) / RADIUS == pytest.approx(np.array(largest.max_at), abs=1e-8)


def test_ten_places_are_apart_from_each_other() -> None:
    vertices, faces = shapes.sphere(3, RADIUS)

    worst = quality(shapes.noisy(vertices), faces).worst_points

    places = np.array([each.position for each in worst]) / RADIUS
    gaps = np.linalg.norm(places[:, None] - places, axis=2)[np.triu_indices(10, 1)]
    assert len(worst) == 10
    assert gaps.min() >= 0.1
    assert [each.distance for each in worst] == sorted(
        (each.distance for each in worst), reverse=True
    )


def test_surfaces_that_agree_have_none() -> None:
    assert quality(*shapes.sphere(3, RADIUS)).worst_points == ()
