"""Faces that pass through each other, and faces that only meet."""

from __future__ import annotations

from itertools import combinations

import igl
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from meshcone.quality.box_pairs import TooManyPairsError, overlapping_pairs
from meshcone.quality.intersections import count_self_intersections
from meshcone.surface import Mesh
from meshcone.surface.arrays import Floats
from meshcone.surface.box_tree import BoxTree
from tests.meshes import sheet, sphere, torus

TRIANGLE = np.array([[0, 0, 0], [4, 0, 0], [0, 4, 0.0]])


def count(mesh: Mesh, most: int = 1_000_000) -> int | None:
    return count_self_intersections(mesh, most)


def two(other: object, faces: object = ((0, 1, 2), (3, 4, 5))) -> Mesh:
    """The triangle with its right angle at the origin, and another."""
    return Mesh(np.concatenate([TRIANGLE, np.atleast_2d(np.array(other))]), np.array(faces))


@pytest.mark.parametrize(
    ("other", "expected"),
    [
        pytest.param([[1, 1, -1], [1, 1, 1], [2, 9, 1]], 1, id="through its inside"),
        pytest.param([[1, -1, -1], [1, -1, 1], [1, 9, 0]], 1, id="from side to side"),
        pytest.param([[1, 1, 1], [1, 2, 1], [2, 1, 1]], 0, id="above it"),
        pytest.param([[5, 5, -1], [5, 5, 1], [9, 9, 0]], 0, id="beside it"),
        pytest.param([[1, 1, 0], [1, 2, 1], [2, 1, 1]], 0, id="touching with a corner"),
        pytest.param([[1, 1, 0], [2, 1, 0], [1, 1, 3]], 0, id="standing on it"),
        pytest.param([[1, 1, 0], [2, 1, 0], [1, 2, 0]], 1, id="lying in it"),
        pytest.param([[1, 1, 0], [9, 1, 0], [9, 2, 0]], 1, id="overlapping in its plane"),
        pytest.param([[4, 0, 0], [4, 4, 0], [0, 4, 0]], 0, id="beside it in its plane"),
        pytest.param([[1, 1, 0], [1, 1, 0], [1, 1, 9]], 0, id="without area"),
    ],
)
def test_two_triangles(other: list[list[float]], expected: int) -> None:
    rotation = Rotation.random(rng=np.random.default_rng(0)).as_matrix()

    assert count(two(other)) == expected
    turned = two(other)
    assert count(turned.moved_to(turned.vertices @ rotation.T + 0.3)) == expected


@pytest.mark.parametrize(
    ("corners", "faces", "expected"),
    [
        pytest.param([[4, 4, 1]], [[0, 1, 2], [1, 3, 2]], 0, id="hinged"),
        pytest.param([[1, 1, 0]], [[0, 1, 2], [2, 1, 3]], 1, id="folded flat onto each other"),
        pytest.param([[-1, 1, 1], [-1, 1, -1]], [[0, 1, 2], [0, 3, 4]], 0, id="at a corner"),
        pytest.param([[2, 2, 1], [2, 2, -1]], [[0, 1, 2], [0, 3, 4]], 1, id="through, at a corner"),
        pytest.param([[9, 9, 9]], [[0, 1, 2], [1, 2, 0]], 0, id="duplicates"),
    ],
)
def test_neighbours(corners: list[list[float]], faces: list[list[int]], expected: int) -> None:
    assert count(two(corners, faces)) == expected


def test_a_speck_on_a_large_face_counts_whichever_of_them_comes_first() -> None:
    """The speck lies in the face's plane; a last digit of it tilts the plane of the speck."""
    speck = np.array([[1, 1, 0], [1.0001, 1, 0], [1, 1.0001, 4e-7]])

    assert count(two(speck)) == 1
    assert count(two(speck, [[3, 4, 5], [0, 1, 2]])) == 1


@pytest.mark.parametrize("mesh", [sphere(3), torus(), sheet(9, 9)])
def test_a_surface_that_does_not_cross_itself_has_none(mesh: Mesh) -> None:
    assert count(mesh) == 0


def test_a_pushed_in_tip_comes_out_on_the_other_side() -> None:
    vertices = sphere(3).vertices.copy()
    vertices[0] *= -1.2

    found = count(sphere(3).moved_to(vertices))

    assert found is not None
    assert found > 0


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**31))
def test_every_pair_libigl_finds_in_a_soup_is_found_and_no_other(seed: int) -> None:
    rng = np.random.default_rng(seed)
    corners = rng.random((40, 1, 3)) + 0.3 * rng.normal(size=(40, 3, 3))
    columns = [[corner[:, None] for corner in triangle] for triangle in corners]

    expected = sum(
        bool(igl.tri_tri_intersection_test_3d(*first, *second)[0])
        for first, second in combinations(columns, 2)
    )

    assert count(Mesh(corners.reshape(-1, 3), np.arange(120).reshape(-1, 3))) == expected


def test_what_was_not_found_with_little_work_is_found_with_more() -> None:
    tip = sphere(2).vertices.copy()
    tip[0] *= -1.5
    mesh = sphere(2).moved_to(tip)

    assert count_self_intersections(mesh, 1) is None
    assert count_self_intersections(mesh, 10_000) == count_self_intersections(mesh, 20_000)


def test_what_would_take_too_long_is_not_tested() -> None:
    assert count(torus(), most=0) is None
    assert count(torus(), most=10) is None


def test_arrays_that_may_not_be_written_to_are_read() -> None:
    vertices, faces = two([[1, 1, -1], [1, 1, 1], [2, 9, 1]]).vertices, np.arange(6).reshape(2, 3)
    vertices.flags.writeable = faces.flags.writeable = False

    assert count(Mesh(vertices, faces)) == 1


def test_positions_that_are_no_numbers_are_not_tested() -> None:
    assert count(torus().moved_to(np.full_like(torus().vertices, np.nan))) is None


def boxes(low: Floats, high: Floats) -> BoxTree:
    """A tree over faces with these boxes."""
    corners = np.stack([low, high, high], axis=1)
    return BoxTree.of(corners.reshape(-1, 3), np.arange(3 * len(low)).reshape(-1, 3))


def test_every_pair_of_overlapping_boxes_is_found_once() -> None:
    rng = np.random.default_rng(3)
    low = rng.random((100, 3))
    high = low + 0.2 * rng.random((100, 3))

    blocks = list(overlapping_pairs(boxes(low, high), most=10_000))
    found = [tuple(sorted(pair)) for block in blocks for pair in zip(*block, strict=True)]

    overlap = ((low[:, None] <= high) & (low <= high[:, None])).all(axis=2)
    expected = [(i, j) for i, j in combinations(range(100), 2) if overlap[i, j]]
    assert sorted(found) == expected


def test_boxes_that_all_overlap_end_the_search() -> None:
    low, high = np.zeros((1000, 3)), np.ones((1000, 3))

    with pytest.raises(TooManyPairsError):
        list(overlapping_pairs(boxes(low, high), most=1000))


def test_boxes_near_each_other_are_found_where_that_is_asked() -> None:
    low = np.array([[0, 0, 0], [2, 0, 0], [9, 0, 0.0]])
    tree = boxes(low, low + 1)

    near = [
        pair
        for block in overlapping_pairs(tree, 9, within=1.5)
        for pair in zip(*block, strict=True)
    ]
    touching = [pair for block in overlapping_pairs(tree, 9) for pair in zip(*block, strict=True)]

    assert near == [(0, 1)]
    assert not touching


def test_only_the_boxes_asked_for_are_looked_at() -> None:
    tree = boxes(np.zeros((1000, 3)), np.ones((1000, 3)))
    two_of_them = np.isin(np.arange(1000), [7, 90])

    blocks = list(overlapping_pairs(tree, 10, among=two_of_them))

    assert [tuple(pair) for block in blocks for pair in np.stack(block, axis=1)] == [(7, 90)]


def test_pairs_come_in_blocks_that_leave_none_out() -> None:
    tree = boxes(np.zeros((500, 3)), np.ones((500, 3)))

    blocks = list(overlapping_pairs(tree, 10**6))
    pairs = np.concatenate([np.stack(block, axis=1) for block in blocks])

    assert len(blocks) > 1
    assert len(pairs) == 500 * 499 // 2 == len(np.unique(pairs, axis=0))


def test_a_search_for_boxes_that_never_meet_ends() -> None:
    """Long boxes along a diagonal, crosswise: their trees' nodes overlap, and no boxes do."""
    at = np.linspace(0, 1, 3000)
    low = np.stack([at, 1 - at, np.zeros(3000)], axis=1)

    assert not sum(len(first) for first, _ in overlapping_pairs(boxes(low, low), most=0))
