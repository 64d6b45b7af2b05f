"""Vertices that have nothing on the reference to follow, and those that have."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from meshcone.program.prepared_reference import PreparedReference
from meshcone.program.trust import across_a_border, without_counterpart
from meshcone.surface import Mesh
from meshcone.surface.arrays import Bools, Ints
from tests.meshes import cylinder, noisy, sheet, sphere, together

BALL = sphere(3)


def prepared(reference: Mesh) -> PreparedReference:
    return PreparedReference.of(reference, len(reference.vertices), seed=0)


def lost(source: Mesh, reference: Mesh) -> Bools:
    ends = np.concatenate([source.edges, source.edges[:, ::-1]])
    shape = (len(source.vertices),) * 2
    adjacency = sparse.coo_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape).tocsr()
    known = prepared(reference)
    distances = known.tree.closest(source.vertices).distances
    pieces: Ints = connected_components(adjacency, directed=False)[1].astype(np.int64)
    return without_counterpart(source, adjacency, pieces, distances, known)


def beside(mesh: Mesh, x: float) -> Mesh:
    return mesh.moved_to(mesh.vertices + np.array([x, 0, 0]))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_piece_the_reference_lacks_is_lost_as_a_whole(seed: int) -> None:
    handle = beside(cylinder(12, 9, 0.1, 0.8), 1.08)  # it stands on the ball and out of it
    source = noisy(together(BALL, handle), 0.01, seed)

    found = lost(source, BALL)

    np.testing.assert_array_equal(np.flatnonzero(found), len(BALL.vertices) + np.arange(12 * 9))


def test_the_far_end_of_a_pipe_is_lost_where_the_reference_is_shorter() -> None:
    pipe = cylinder(12, 17, 0.5, 1.6)
    shorter = Mesh(pipe.vertices, pipe.faces[pipe.corners[:, :, 2].max(axis=1) < 0.25])

    found = lost(pipe, shorter)

    np.testing.assert_array_equal(found, pipe.vertices[:, 2] > 0.25)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_spikes_are_not_lost(seed: int) -> None:
    generator = np.random.default_rng(seed)
    spiked = BALL.vertices.copy()
    spiked[generator.choice(len(spiked), 6, replace=False)] *= 1.3

    assert not lost(BALL.moved_to(spiked), BALL).any()


def test_nothing_is_lost_of_a_source_that_has_yet_to_cover_the_reference() -> None:
    long = BALL.moved_to(BALL.vertices * [0.2, 0.2, 1.0])

    assert not lost(sphere(3), long).any()
    assert not lost(long, sphere(3)).any()


def test_a_part_is_not_lost_where_the_source_lacks_another() -> None:
    here, there = beside(BALL, -3.0), beside(BALL, 3.0)

    assert not lost(together(BALL, here), together(BALL, there)).any()


def test_what_lies_over_a_hole_is_across_its_border() -> None:
    above = BALL.corners[:, :, 2].max(axis=1) > 0.8
    open_ball = Mesh(BALL.vertices, BALL.faces[~above])
    source = noisy(BALL, 0.005)
    known = prepared(open_ball)

    found = across_a_border(source.vertices, known.tree.closest(source.vertices), known.tree.mesh)

    height = BALL.vertices[:, 2]
    rim = open_ball.vertices[open_ball.border_vertices][:, 2].max()
    assert found[height > rim + 0.02].all()
    assert not found[height < rim - 0.02].any()


@pytest.mark.parametrize("share", [0.2, 0.36, 0.45])
def test_what_the_reference_lacks_is_across_its_border_be_it_the_most(share: float) -> None:
    cap = Mesh(BALL.vertices, BALL.faces[BALL.corners[:, :, 2].mean(axis=1) > 1 - 2 * share])
    source = noisy(BALL, 0.005)
    known = prepared(cap)

    found = across_a_border(source.vertices, known.tree.closest(source.vertices), known.tree.mesh)

    # Beyond the far side of a cap, the closest points are in the direction of its normals.
    height, rim = BALL.vertices[:, 2], cap.vertices[cap.border_vertices][:, 2].min()
    assert found[(height < rim - 0.05) & (height > rim - 0.3)].all()


def test_nothing_is_across_the_border_of_a_closed_reference() -> None:
    source, known = noisy(BALL, 0.02), prepared(BALL)

    assert not across_a_border(
        source.vertices, known.tree.closest(source.vertices), known.tree.mesh
    ).any()


def test_what_lies_above_a_border_is_not_across_it() -> None:
    flat = sheet(5, 5)
    known = prepared(flat)
    raised = flat.vertices + np.array([0, 0, 0.3])

    assert not across_a_border(raised, known.tree.closest(raised), known.tree.mesh).any()


def test_a_piece_with_most_of_the_vertices_is_lost_all_the_same() -> None:
    inner = sphere(3)
    source = noisy(together(sphere(2), inner.moved_to(0.8 * inner.vertices)), 0.005)

    found = lost(source, sphere(2))

    np.testing.assert_array_equal(found, np.arange(len(found)) >= len(sphere(2).vertices))


@pytest.mark.parametrize("height", [1.06, 1.021])
@pytest.mark.parametrize("sigma", [0.0, 0.002])
def test_a_knob_close_above_the_reference_is_lost(height: float, sigma: float) -> None:
    source = noisy(together(BALL, beside(small_ball(), height)), sigma)

    found = lost(source, BALL)

    np.testing.assert_array_equal(found, np.arange(len(found)) >= len(BALL.vertices))


def test_a_knob_that_stands_on_the_reference_with_half_of_its_vertices_is_lost() -> None:
    plate = sheet(9, 9)
    tent = Mesh(
        np.array([[3.2, 3.2, 0], [4.7, 3.4, 0], [3.9, 4.6, 0.1], [3.5, 3.6, 0.1]]),
        np.array([[0, 1, 2], [0, 2, 3], [1, 3, 2]]),
    )

    found = lost(together(plate, tent), plate)

    np.testing.assert_array_equal(found, np.arange(len(found)) >= len(plate.vertices))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_knob_that_the_reference_has_is_not_lost_however_far_it_is_off(seed: int) -> None:
    knob = beside(small_ball(), 1.03)
    off = beside(noisy(knob, 0.01, seed), 0.01)

    assert not lost(together(BALL, off), together(BALL, knob)).any()


def small_ball() -> Mesh:
    ball = sphere(1)
    return ball.moved_to(0.02 * ball.vertices)
