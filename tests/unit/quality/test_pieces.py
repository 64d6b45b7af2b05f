"""A connected piece that falls to a fraction of its area has shrunk, if not to the reference."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.quality.pieces import Pieces
from meshcone.surface import Mesh, sample_surface
from meshcone.surface.arrays import Bools
from tests.meshes import noisy, sphere, together, torus

BALL = sphere(3)


def at(mesh: Mesh, x: float, scale: float) -> Mesh:
    return mesh.moved_to(scale * mesh.vertices + np.array([x, 0, 0]))


def shrunken(before: Mesh, after: Mesh, reference: Mesh) -> Bools:
    samples = sample_surface(reference, 2000, 5).in_space().points
    return Pieces.of(before).shrunken(before, after, reference, samples)


def knobs(*scales: float) -> Mesh:
    places = zip((1.2, -1.2), scales, strict=True)
    return together(BALL, *(at(sphere(1), x, scale) for x, scale in places))


@pytest.mark.parametrize("left", [0.4, 1e-6])
def test_a_piece_without_a_counterpart_that_falls_to_a_fraction_has_shrunk(left: float) -> None:
    found = shrunken(knobs(0.1, 0.1), knobs(0.1, 0.1 * left), BALL)

    assert found.tolist() == [False, False, True]


def test_a_piece_that_moves_has_not_shrunk() -> None:
    moved = together(at(BALL, 0, 1), at(sphere(1), 1.1, 0.1), at(sphere(1), -1.15, 0.09))

    assert not shrunken(knobs(0.1, 0.1), moved, BALL).any()


def test_a_piece_that_becomes_as_small_as_its_counterpart_has_not_shrunk() -> None:
    assert not shrunken(knobs(0.3, 0.1), knobs(0.1, 0.1), knobs(0.1, 0.1)).any()


def test_a_ring_that_becomes_a_line_has_shrunk_though_it_is_as_wide() -> None:
    ring, line = torus(24, 8, tube=0.2), torus(24, 8, tube=0.001)
    before, after = (together(BALL, at(each, 5, 0.5)) for each in (ring, line))

    assert shrunken(before, after, BALL).tolist() == [False, True]


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_noise_takes_its_area_with_it(seed: int) -> None:
    dense = sphere(5)
    source = noisy(dense, 0.1, seed)
    assert source.face_areas.sum() > 4 * dense.face_areas.sum()

    assert not shrunken(source, dense, dense).any()


def test_a_pair_of_faces_counts_once_at_each_piece_that_it_touches() -> None:
    pieces = Pieces.of(knobs(0.1, 0.1))
    ball, knob = 0, len(BALL.faces)

    found = pieces.counts(np.array([[ball, ball + 1], [ball, knob], [knob, knob + 1]]))

    assert found.tolist() == [2, 2, 0]
