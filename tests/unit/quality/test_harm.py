"""An answer is held against its input where it counts."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.quality.harm import HarmCheck
from meshcone.surface import Mesh, SurfaceTree
from tests.meshes import joined_halves, noisy, sheet, sphere, together

REFERENCE = sphere(3)


def check(source: Mesh, reference: Mesh = REFERENCE) -> HarmCheck:
    return HarmCheck(source, reference, SurfaceTree(reference), 5_000_000)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_nothing_speaks_against_the_reference_itself(seed: int) -> None:
    assert check(noisy(REFERENCE, 0.02, seed)).objections(REFERENCE.vertices) == []


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_nothing_speaks_against_the_input(seed: int) -> None:
    source = noisy(REFERENCE, 0.02, seed)

    assert check(source).objections(source.vertices) == []


def test_any_move_away_from_a_perfect_input_is_worse() -> None:
    [objection] = check(REFERENCE).objections(noisy(REFERENCE, 1e-5).vertices)

    assert objection.startswith("the mean distance grows from")


def test_what_is_gained_is_measured_at_the_same_places() -> None:
    # Every place comes closer by .01, though some are .02 and others 1 away; of the reference's
    # places the inner ball is the closest.
    source = Mesh(
        np.concatenate([1.02 * REFERENCE.vertices, 2 * REFERENCE.vertices]),
        np.concatenate([REFERENCE.faces, REFERENCE.faces + len(REFERENCE.vertices)]),
    )
    closer = np.concatenate([1.01 * REFERENCE.vertices, 1.99 * REFERENCE.vertices])
    held = check(source)

    gain = held.gain(held.examine(closer))

    assert gain.mean == pytest.approx(0.01, rel=0.01)
    assert gain.error < 1e-5


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_one_vertex_torn_off_is_worse_though_the_mean_falls(seed: int) -> None:
    source = noisy(REFERENCE, 0.02, seed)
    answer = REFERENCE.vertices.copy()
    answer[17] *= 1.2

    [objection] = check(source).objections(answer)

    assert objection.startswith("the largest distance grows from")
    assert "to 0.2 of the radius" in objection


def test_the_input_is_as_far_away_as_its_farthest_vertex_though_no_sample_sees_it() -> None:
    """Its own spike is thin, and samples of it end half-way up; the answer's is seen whole."""
    source, answer = (REFERENCE.vertices.copy() for _ in range(2))
    source[17] *= 1.3
    answer[40] *= 1.3
    judge = check(REFERENCE.moved_to(source))

    assert judge.input.distances.max < 0.29
    assert judge.objections(answer) == []


@pytest.mark.parametrize("bulge", [1.05, 1.023])
def test_a_bulge_over_a_tenth_of_the_surface_is_worse_though_the_rest_is_perfect(
    bulge: float,
) -> None:
    source = REFERENCE.moved_to(1.02 * REFERENCE.vertices)
    answer = REFERENCE.vertices.copy()
    answer[answer[:, 2] > 0.7] *= bulge

    found = check(source).objections(answer)

    assert [clause.split(" grows")[0] for clause in found] == [
        "the 95th percentile of the distance",
        "the largest distance",
    ]


def test_a_bulge_that_samples_cannot_tell_from_what_was_there_is_not_worse() -> None:
    source = REFERENCE.moved_to(1.02 * REFERENCE.vertices)
    answer = REFERENCE.vertices.copy()
    answer[answer[:, 2] > 0.7] *= 1.0203

    assert check(source).objections(answer) == []


def test_faces_that_turn_over_are_worse_though_every_distance_falls() -> None:
    reference = sheet(12, 12)
    source = reference.moved_to(reference.vertices + np.array([0, 0, 0.3]))
    answer = reference.vertices.copy()
    inner = ((answer[:, :2] > 2.5) & (answer[:, :2] < 8.5)).all(axis=1)
    answer[inner, 0] = 11 - answer[inner, 0]  # mirrored within the plane

    found = check(source, reference).objections(answer)

    assert any("turn their backs on the reference" in clause for clause in found)


def test_faces_that_pass_through_each_other_are_worse_though_every_distance_falls() -> None:
    ball = sphere(2)
    shells = np.concatenate([1.05 * ball.vertices, 0.95 * ball.vertices])
    source = Mesh(shells, np.concatenate([ball.faces, ball.faces + len(ball.vertices)]))
    answer = np.concatenate([noisy(ball, 0.01, seed).vertices for seed in (1, 2)])

    [objection] = check(source, ball).objections(answer)

    assert objection.endswith("more pairs of faces pass through each other")


def test_faces_may_pass_through_each_other_where_those_of_the_reference_do() -> None:
    ball = sphere(2)
    apart, crossing = (
        Mesh(
            np.concatenate([ball.vertices, ball.vertices + np.array([x, 0, 0])]),
            np.concatenate([ball.faces, ball.faces + len(ball.vertices)]),
        )
        for x in (2.2, 1.8)
    )

    assert check(apart, crossing).objections(crossing.vertices) == []


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_mesh_inside_out_as_a_whole_turns_no_more_faces_over_by_staying_so(seed: int) -> None:
    inside_out = Mesh(REFERENCE.vertices, REFERENCE.faces[:, ::-1])

    assert check(noisy(inside_out, 0.02, seed)).objections(REFERENCE.vertices) == []


def test_a_seam_that_opens_is_worse_though_every_distance_falls() -> None:
    seam = joined_halves(2, 4)
    source = seam.moved_to(seam.vertices + np.array([0, 0, 0.1]))
    answer = seam.vertices.copy()
    answer[(seam.vertices[:, :2] == [1, 0.25]).all(axis=1), 2] = 0.05

    held = check(source, sheet(3, 2))
    [objection] = held.objections(answer)

    assert objection == "a border opens by 0.05 of the radius where another lies on it"
    torn = held.places(held.examine(answer))
    np.testing.assert_array_equal(seam.vertices[torn], [[1, 0, 0], [1, 0.25, 0], [1, 0.5, 0]])


def knob(x: float, scale: float = 0.05) -> Mesh:
    ball = sphere(2)
    return ball.moved_to(scale * ball.vertices + np.array([x, 0, 0]))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_piece_that_falls_to_a_dot_is_worse_though_every_distance_falls(seed: int) -> None:
    judge = check(noisy(together(REFERENCE, knob(1.1)), 0.002, seed))
    answer = together(REFERENCE, knob(1.001, 1e-6)).vertices

    [objection] = judge.objections(answer)

    assert objection == "320 faces are of pieces that lose most of their area"
    places = judge.places(judge.examine(answer))
    np.testing.assert_array_equal(places, np.arange(len(places)) >= len(REFERENCE.vertices))


@pytest.mark.parametrize("seed", [2, 3, 4])
def test_what_is_allowed_of_a_mesh_is_not_all_allowed_of_a_small_piece(seed: int) -> None:
    # The whole has 1,600 faces, one in twenty of which may be amiss where it comes much closer.
    judge = check(together(noisy(REFERENCE, 0.01, seed), knob(1.1)))
    answer = together(REFERENCE, noisy(knob(1.1), 0.006, seed))

    found = judge.defects(judge.examine(answer.vertices))

    assert found
    assert all(clause.endswith("at a piece of 320 faces") for clause in found)


def test_a_small_part_that_slides_is_worse_though_its_corners_stay_on_the_reference() -> None:
    # A wedge on a plate, a corner of which slides along the plate under the wedge.
    plate = sheet(21, 21)
    wedge = Mesh(
        np.array([[10.2, 10.2, 0], [10.8, 10.2, 0], [10.2, 10.2, 0.3], [10.8, 10.2, 0.3]]),
        np.array([[0, 1, 3], [0, 3, 2]]),
    )
    reference = together(plate, wedge)
    noise = np.random.default_rng(1).normal(scale=0.02, size=reference.vertices.shape)
    slid = reference.vertices.copy()
    slid[-4] += [0, 0.25, 0]

    found = check(reference.moved_to(reference.vertices + noise), reference).objections(slid)

    assert len(found) == 1
    assert found[0].startswith("the largest distance grows from")
