"""Borders that lie on each other move as one, and nothing else does."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.program.seams import Seams
from meshcone.surface import Mesh
from tests.meshes import sheet, sphere


def halves(gap: float, cells: int = 6) -> tuple[Mesh, np.ndarray]:
    """Two sheets of unit height side by side, and the pairs of vertices at their seam."""
    size = cells + 1
    one = sheet(size, size)
    scaled = one.vertices / cells
    other = scaled + np.array([1.0 + gap, 0, 0])
    mesh = Mesh(
        np.concatenate([scaled, other]), np.concatenate([one.faces, one.faces + size * size])
    )
    left = np.flatnonzero(scaled[:, 0] == 1)
    return mesh, np.stack([left, size * size + np.arange(size)], axis=1)


@pytest.mark.parametrize("gap", [0.0, 5e-8, 1e-6, 9e-5])
def test_the_two_sides_of_a_seam_are_joined(gap: float) -> None:
    mesh, pairs = halves(gap)

    seams = Seams.of(mesh)

    assert len(seams.joined.vertices) == len(mesh.vertices) - len(pairs)
    np.testing.assert_array_equal(seams.group[pairs[:, 0]], seams.group[pairs[:, 1]])
    np.testing.assert_array_equal(seams.joined.vertices, mesh.vertices[seams.first])
    np.testing.assert_array_equal(seams.joined.faces, seams.group[mesh.faces])
    assert seams.joined.border_sides.sum() == mesh.border_sides.sum() - 2 * (len(pairs) - 1)


@pytest.mark.parametrize("gap", [2e-4, 0.01])
def test_borders_that_lie_apart_stay_apart(gap: float) -> None:
    assert Seams.of(halves(gap)[0]).trivial


@pytest.mark.parametrize(("step", "joined"), [(0.001, True), (0.0005, False)])
def test_sides_that_a_coarse_file_rounded_apart_are_joined(step: float, joined: bool) -> None:
    mesh, pairs = halves(0.003)
    coarse = Mesh(mesh.vertices, mesh.faces, precision=np.full(len(mesh.vertices), step))

    group = Seams.of(coarse).group

    assert (group[pairs[:, 0]] == group[pairs[:, 1]]).all() == joined


def test_steps_as_coarse_as_the_edges_join_nothing() -> None:
    mesh, _ = halves(0.05)
    coarse = Mesh(mesh.vertices, mesh.faces, precision=np.full(len(mesh.vertices), 0.1))

    assert Seams.of(coarse).trivial


def test_a_gap_is_what_it_was_wherever_its_sides_move() -> None:
    mesh, pairs = halves(9e-5)
    seams = Seams.of(mesh)
    moved = seams.joined.vertices + np.random.default_rng(0).normal(size=(len(seams.first), 3))

    spread = seams.spread(moved)

    across = mesh.vertices[pairs[:, 1]] - mesh.vertices[pairs[:, 0]]
    np.testing.assert_allclose(spread[pairs[:, 1]] - spread[pairs[:, 0]], across, atol=1e-14)
    np.testing.assert_allclose(seams.gathered(spread), moved, atol=1e-14)


def test_what_does_not_move_stays_to_the_last_bit() -> None:
    mesh, _ = halves(3e-7)
    seams = Seams.of(mesh)

    np.testing.assert_array_equal(seams.spread(seams.joined.vertices), mesh.vertices)


def test_no_face_is_lost_where_a_border_is_finer_than_the_gap() -> None:
    mesh, _ = halves(0.0, cells=4)
    fine = mesh.moved_to(mesh.vertices * 1e-4)

    seams = Seams.of(fine)

    corners = np.sort(seams.joined.faces, axis=1)
    assert (np.diff(corners, axis=1) > 0).all()


def test_four_corners_that_meet_become_one() -> None:
    one = sheet(4, 4)
    shifts = [np.array([x, y, 0]) * (3 + 1e-6) for x in (0, 1) for y in (0, 1)]
    mesh = Mesh(
        np.concatenate([one.vertices + shift for shift in shifts]),
        np.concatenate([one.faces + 16 * k for k in range(4)]),
    )

    seams = Seams.of(mesh)

    assert len(seams.first) == 4 * 16 - 4 * 4 + 1
    assert np.bincount(seams.group).max() == 4


def test_a_mesh_far_smaller_than_its_reference_joins_nothing_of_its_inside() -> None:
    tiny = sheet(40, 40)
    tiny = tiny.moved_to(1e-6 * tiny.vertices)

    assert Seams.of(tiny).trivial


def test_a_mesh_without_borders_is_as_it_was() -> None:
    ball = sphere(2)

    seams = Seams.of(ball)

    assert seams.trivial
    assert seams.joined is ball
