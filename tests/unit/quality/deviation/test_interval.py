"""What branch and bound says of any two surfaces."""

from __future__ import annotations

from fractions import Fraction
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from meshcone.quality.deviation.check import check_leaves
from meshcone.quality.deviation.interval import Asked, Interval, directed_deviation
from meshcone.quality.deviation.triangles import Triangles
from meshcone.surface import Mesh
from tests.shapes import noisy, sphere
from tests.unit.quality.deviation.soups import KINDS, distances, scattered, soup

NARROW = Asked(width=1e-4, share=1e-3, most_pieces=50_000)


def deviation(mesh: Mesh, reference: Mesh, asked: Asked = NARROW) -> Interval:
    return directed_deviation(mesh, reference, asked)


def merged(*meshes: Mesh) -> Mesh:
    offsets = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate(
            [mesh.faces + offset for mesh, offset in zip(meshes, offsets, strict=False)]
        ),
    )


def ball(subdivisions: int = 3, radius: float = 1.0) -> Mesh:
    return Mesh(*sphere(subdivisions, radius))


def grid(steps: int, height: float = 0.0, *, turned: bool = False) -> Mesh:
    """The unit square in steps², each cut along one diagonal or the other."""
    side = np.linspace(0, 1, steps + 1)
    vertices = np.array([(x, y, height) for x, y in product(side, side)])
    faces = []
    for row, column in product(range(steps), range(steps)):
        a = row * (steps + 1) + column
        b, c, d = a + 1, a + steps + 2, a + steps + 1
        faces += [(a, b, c), (a, c, d)] if not turned else [(a, b, d), (b, c, d)]
    return Mesh(vertices, np.array(faces))


@settings(max_examples=40, deadline=None)
@given(
    st.integers(0, 10_000),
    st.sampled_from(KINDS),
    st.sampled_from(KINDS),
    st.integers(1, 12),
    st.integers(1, 12),
)
def test_no_sample_of_any_two_soups_lies_outside_the_interval(
    seed: int, kind: str, other: str, faces: int, others: int
) -> None:
    mesh, reference = soup(seed, faces, kind), soup(seed + 1, others, other)
    found = deviation(mesh, reference, Asked(1e-3, 1e-3, 2000))
    assert distances(scattered(mesh, 500), reference).max() <= found.upper * (1 + 1e-9)
    assert found.lower <= found.upper
    at = distances(found.farthest.position[None], reference)[0]
    assert at >= found.lower - 1e-12 * np.abs(mesh.vertices).max()


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from(KINDS), st.sampled_from(KINDS))
def test_both_ends_are_proven_again_without_the_search(seed: int, kind: str, other: str) -> None:
    mesh, reference = soup(seed, 5, kind), soup(seed + 1, 6, other)
    found = deviation(mesh, reference, Asked(1e-3, 1e-3, 500))
    reach = max(np.abs(mesh.vertices).max(), np.abs(reference.vertices).max())
    assert check_leaves(mesh, reference, found.leaves) <= found.upper + 1e-12 * reach
    lower = Triangles(reference).distance_at_least(found.farthest.position)
    assert abs(lower - found.lower) <= 1e-7 * reach


def test_leaves_of_many_generations_are_written_down_in_order() -> None:
    mesh, reference = Mesh(*sphere(1, 1.0)), ball(3)
    found = deviation(mesh, reference, Asked(1e-4, 0, 50_000))
    assert found.pieces > 200
    assert found.answered
    assert found.upper * (1 - 1e-9) <= check_leaves(mesh, reference, found.leaves) <= found.upper


def test_the_order_of_faces_and_vertices_changes_rounding_only() -> None:
    mesh, reference = ball(2), Mesh(noisy(sphere(2, 1.0)[0]), sphere(2)[1])
    random = np.random.default_rng(3)
    names = random.permutation(len(mesh.vertices))
    places = np.argsort(names)
    shuffled = Mesh(mesh.vertices[names], places[random.permutation(mesh.faces)])
    first, second = deviation(mesh, reference), deviation(shuffled, reference)
    assert second.lower == pytest.approx(first.lower, abs=1e-12)
    assert abs(second.upper - first.upper) <= NARROW.width


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_a_motion_and_a_scale_change_rounding_only(scale: float) -> None:
    mesh, reference = ball(2), Mesh(noisy(sphere(2, 1.0)[0]), sphere(2)[1])
    turn = Rotation.from_rotvec([0.3, -1.2, 0.7])
    moved, other = (
        each.moved_to(scale * (turn.apply(each.vertices) + np.array([3.0, -2.0, 5.0])))
        for each in (mesh, reference)
    )
    first = deviation(mesh, reference)
    second = deviation(moved, other, Asked(scale * NARROW.width, NARROW.share, 50_000))
    assert second.lower == pytest.approx(scale * first.lower, rel=1e-9)
    assert second.upper == pytest.approx(scale * first.upper, rel=3e-3)


def test_spheres_of_two_sizes_differ_by_what_their_radii_do() -> None:
    """A vertex of the larger lies over the same vertex of the smaller, which is its closest."""
    found = deviation(ball(3, 1.2), ball(3, 1.0))
    assert found.answered
    assert found.lower <= 0.2 + 1e-12
    assert found.upper >= 0.2
    assert found.upper - found.lower <= 2e-3


def test_the_middle_between_two_plates_is_half_their_distance_away() -> None:
    """Every point is on the medial axis: no face is closer than the other."""
    plates = merged(grid(4, 0.0), grid(4, 0.2, turned=True))
    found = deviation(grid(3, 0.1), plates)
    assert found.answered
    assert found.lower == pytest.approx(0.1, abs=1e-9)
    assert found.upper == pytest.approx(0.1, abs=2e-4)


def test_the_farthest_point_of_a_face_is_where_its_crease_is() -> None:
    """Exact: over two points 2 apart, a segment between is farthest at its middle, 1 away."""
    points = np.array([[-1.0, 0, 0], [1, 0, 0]])
    reference = Mesh(np.repeat(points, 3, axis=0), np.arange(6).reshape(2, 3))
    segment = Mesh(np.array([[-1.0, 0, 0], [1, 0, 0], [1, 0, 0]]), np.array([[0, 1, 2]]))
    found = deviation(segment, reference, Asked(1e-9, 0, 1000))
    assert Fraction(found.lower) <= Fraction(1) <= Fraction(found.upper)
    assert found.upper - found.lower <= 1e-8


def test_two_triangulations_of_one_plane_are_one_surface() -> None:
    """Sampled distances cannot tell; neither side has a vertex the other has not."""
    found = deviation(grid(6), grid(6, turned=True), Asked(1e-9, 0, 5000))
    assert found.answered
    assert found.lower == 0
    assert found.upper <= 1e-12


def test_a_mesh_on_itself_does_not_deviate_at_all() -> None:
    mesh = ball()
    shuffled = Mesh(mesh.vertices, np.roll(mesh.faces[::-1], 1, axis=1))
    found = deviation(mesh, shuffled)
    assert (found.lower, found.upper, found.pieces) == (0, 0, 0)


def test_a_fold_inside_is_seen() -> None:
    """One small face, a tenth of the radius under the surface."""
    mesh = ball()
    fold = Mesh(0.9 * mesh.corners[100], np.array([[0, 1, 2]]))
    found = deviation(merged(mesh, fold), mesh)
    depth = distances(scattered(fold, 2000), mesh).max()
    assert depth <= found.upper <= depth + 3e-4
    np.testing.assert_allclose(np.linalg.norm(found.farthest.position), 0.9, atol=0.01)


def test_a_spike_between_all_samples_is_seen() -> None:
    mesh = ball(4)
    spiked = mesh.vertices.copy()
    spiked[77] *= 1.05
    found = deviation(mesh.moved_to(spiked), mesh)
    assert found.lower == pytest.approx(0.05, abs=2e-4)
    np.testing.assert_allclose(found.farthest.position, spiked[77])


def test_a_fin_too_thin_for_any_sample_is_seen() -> None:
    mesh = ball()
    foot = mesh.vertices[50]
    fin = np.array([foot, 1.3 * foot, foot + 1e-5 * np.cross(foot, [0.3, 0.4, 0.5])])
    found = deviation(merged(mesh, Mesh(fin, np.array([[0, 1, 2]]))), mesh)
    assert found.lower == pytest.approx(0.3, abs=1e-3)
    assert found.upper == pytest.approx(0.3, abs=1e-3)


@pytest.mark.parametrize("away", [10.0, 1e4])
def test_what_lies_elsewhere_is_as_far_as_it_is(away: float) -> None:
    mesh = ball(2)
    found = deviation(mesh.moved_to(mesh.vertices + np.array([away, 0, 0])), mesh)
    assert found.answered
    assert found.lower <= away <= found.upper


def test_pieces_that_run_out_leave_an_honest_interval() -> None:
    mesh, reference = ball(2), Mesh(noisy(sphere(2, 1.0)[0], 0.2), sphere(2)[1])
    best = deviation(mesh, reference, Asked(1e-6, 0, 200_000))
    early = deviation(mesh, reference, Asked(1e-6, 0, 0))
    assert not early.answered
    assert early.pieces == 0
    assert early.lower <= best.lower <= best.upper <= early.upper


@pytest.mark.parametrize("share", [0.5, 0.99, 1.01, 2.0])
def test_a_bar_is_decided_before_the_distance_is_known(share: float) -> None:
    mesh, reference = ball(2), Mesh(noisy(sphere(2, 1.0)[0]), sphere(2)[1])
    known = deviation(mesh, reference, Asked(1e-5, 0, 200_000))
    bar = share * known.upper
    found = deviation(mesh, reference, Asked(1e-5, 0, 200_000, bars=(bar,)))
    assert found.answered
    assert (found.lower > bar) == (share < 1)
    assert (found.upper <= bar) == (share > 1)
    assert found.pieces <= known.pieces


def test_several_bars_are_all_decided() -> None:
    mesh, reference = ball(2), Mesh(noisy(sphere(2, 1.0)[0]), sphere(2)[1])
    true = deviation(mesh, reference, Asked(1e-6, 0, 200_000)).upper
    found = deviation(mesh, reference, Asked(0, 0, 200_000, bars=(2 * true, 0.9 * true)))
    assert 0.9 * true < found.lower
    assert found.upper <= 2 * true
