"""How far a mesh goes outside and inside of a closed reference."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.quality.deviation.interval import Asked
from meshcone.quality.deviation.search import Search
from meshcone.quality.deviation.sides import Side, deviation_by_side
from meshcone.quality.directions import inside
from meshcone.quality.intersections import pass_through_each_other
from meshcone.surface import Mesh
from meshcone.surface.arrays import Bools, Floats
from tests.shapes import noisy, sphere
from tests.unit.quality.deviation.soups import distances, scattered
from tests.unit.quality.deviation.test_interval import ball

ASKED = Asked(width=1e-3, share=1e-3, most_pieces=100_000)


def by_side(mesh: Mesh, reference: Mesh, asked: Asked = ASKED) -> tuple[Side, Side]:
    search = Search(mesh, reference)
    search.run(asked.level, asked.most_pieces)
    return deviation_by_side(search, lambda points: inside(points, reference), asked)


def test_a_bump_is_outside_and_a_dent_is_inside() -> None:
    mesh = ball(3)
    vertices = mesh.vertices.copy()
    vertices[100] *= 1.05
    vertices[200] *= 0.98
    outside, within = by_side(mesh.moved_to(vertices), mesh)
    assert outside.answered
    assert within.answered
    assert outside.upper == pytest.approx(0.05, abs=2e-3)
    assert within.upper == pytest.approx(0.02, abs=2e-3)
    np.testing.assert_allclose(outside.position, vertices[100])


def test_what_is_outside_alone_has_nothing_inside() -> None:
    outside, within = by_side(ball(2, 1.2), ball(2))
    assert outside.lower <= 0.2 + 1e-9
    assert outside.upper >= 0.2 - 1e-9
    assert (within.lower, within.position) == (0, None)
    assert within.upper <= 1e-3


def test_no_sample_is_beyond_the_interval_of_its_side() -> None:
    mesh, reference = Mesh(noisy(sphere(2, 1.0)[0]), sphere(2)[1]), ball(3)
    sides = by_side(mesh, reference)
    points = scattered(mesh, 2000)
    found, enclosed = distances(points, reference), inside(points, reference)
    for side, here in zip(sides, (~enclosed, enclosed), strict=True):
        assert found[here].max() <= side.upper + 1e-12
        assert side.lower <= side.upper
        assert side.position is not None
        assert distances(side.position[None], reference)[0] >= side.lower - 1e-12


def test_pieces_that_run_out_leave_honest_intervals() -> None:
    mesh, reference = Mesh(noisy(sphere(2, 1.0)[0]), sphere(2)[1]), ball(3)
    best, early = by_side(mesh, reference), by_side(mesh, reference, Asked(1e-6, 0, 0))
    for one, other in zip(best, early, strict=True):
        assert other.lower <= one.upper
        assert one.lower <= other.upper


def test_a_cage_that_passes_through_nowhere_has_nothing_inside() -> None:
    cage, mesh = ball(1, 1.3), ball(3)  # with coarse faces, near the ball at their middles
    search = Search(cage, mesh)
    search.run(ASKED.level, ASKED.most_pieces)
    apart = not pass_through_each_other(cage, mesh, 1_000_000)

    few = Asked(ASKED.width, ASKED.share, search.pieces.count - search.pieces.faces)
    outside, within = deviation_by_side(
        search, lambda points: inside(points, mesh), few, lambda: apart
    )

    assert apart
    assert (within.lower, within.upper) == (0, 0)
    assert outside.upper == pytest.approx(search.upper, rel=1e-9)


@pytest.mark.parametrize(("radius", "passes"), [(1.3, False), (0.7, False), (1.02, True)])
def test_meshes_pass_through_each_other_where_a_face_does(radius: float, passes: bool) -> None:
    assert pass_through_each_other(ball(1, radius), ball(3), 1_000_000) == passes


def test_where_it_takes_too_long_meshes_may_pass_through_each_other() -> None:
    assert pass_through_each_other(ball(3, 1.01), ball(3), 10)


def test_what_is_too_near_to_matter_is_on_neither_side_and_is_not_asked_for() -> None:
    mesh, reference = Mesh(noisy(sphere(4, 1.0)[0]), sphere(4)[1]), ball(4)
    search = Search(mesh, reference)
    search.run(ASKED.level, ASKED.most_pieces)
    asked: list[int] = []

    def encloses(points: Floats) -> Bools:
        asked.append(len(points))
        return inside(points, reference)

    outside, within = deviation_by_side(search, encloses, ASKED)

    assert outside.answered
    assert within.answered
    assert sum(asked) < len(search.known_points()[0]) / 2
