"""Faces divided into smaller ones, in whole numbers."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meshcone.surface import Subdivision
from meshcone.surface.subdivision import MAX_EXPONENT

# The corners of a triangle, the middles of its sides, and a point inside, over 4.
A, B, C = (4, 0, 0), (0, 4, 0), (0, 0, 4)
AB, BC, CA = (2, 2, 0), (0, 2, 2), (2, 0, 2)
INSIDE = (2, 1, 1)

RED = [(A, AB, CA), (AB, B, BC), (CA, BC, C), (AB, BC, CA)]
FAN = [(A, B, INSIDE), (B, C, INSIDE), (C, A, INSIDE)]


def one_face(*children, exponent: int = 2) -> Subdivision:
    return Subdivision(1, np.zeros(len(children)), np.array(children), exponent)


@pytest.mark.parametrize("children", [RED, FAN, [(A, AB, C), (AB, B, C)], [(B, C, A)]])
def test_children_that_fill_their_parent_are_a_tiling(children):
    assert one_face(*children).is_tiling()


@pytest.mark.parametrize(
    "children",
    [
        RED[:3],
        [*RED, RED[0]],
        [*RED, *RED],
        [(A, B, C)] * 17,
        [(C, B, A)],
        [(A, AB, CA), (AB, B, BC), (CA, BC, C), (AB, CA, BC)],
        # An overlap that a gap of the same size makes up for.
        [(A, AB, CA), (A, AB, CA), (CA, BC, C), (AB, BC, CA)],
        # A corner within another child's side.
        [(AB, B, C), (A, AB, (1, 1, 2)), (A, (1, 1, 2), C)],
        # Corners outside, whose numbers add up.
        [((-4, 4, 4), B, C), (A, B, (-4, 4, 4)), (A, (-4, 4, 4), C)],
        [((4, 4, 0), B, C)],
        [],
    ],
)
def test_children_that_do_not_are_none(children):
    assert not Subdivision(
        1, np.zeros(len(children)), np.array(children).reshape(-1, 3, 3), 2
    ).is_tiling()


@pytest.mark.parametrize(
    ("sources", "parents"), [(1, [1]), (1, [-1]), (2, [0]), (0, [0]), (2, [1, 0])]
)
def test_children_of_no_face_or_out_of_order_are_no_tiling(sources, parents):
    corners = np.array([(A, B, C)] * len(parents))
    assert not Subdivision(sources, np.array(parents), corners, 2).is_tiling()


@pytest.mark.parametrize("exponent", [-1, 1, 3, MAX_EXPONENT + 1])
def test_an_exponent_that_is_not_the_corners_is_no_tiling(exponent):
    assert not one_face((A, B, C), exponent=exponent).is_tiling()


def test_the_finest_exponent_is_still_exact():
    whole = 2**MAX_EXPONENT
    a, b, c = (whole, 0, 0), (0, whole, 0), (0, 0, whole)
    near = (whole - 2, 1, 1)
    assert one_face((a, b, near), (b, c, near), (c, a, near), exponent=MAX_EXPONENT).is_tiling()
    off = (whole - 3, 2, 1)
    assert not one_face((a, b, near), (b, c, off), (c, a, near), exponent=MAX_EXPONENT).is_tiling()


def two_faces(first, second) -> Subdivision:
    parents = np.repeat([0, 1], [len(first), len(second)])
    return Subdivision(2, parents, np.array([*first, *second]), 2)


SQUARE = np.array([[0, 1, 2], [2, 1, 3]])  # they share the side from 1 to 2


def test_a_shared_side_is_divided_once():
    both = two_faces([(A, B, BC), (A, BC, C)], [(A, AB, C), (AB, B, C)])
    assert both.is_conforming(SQUARE)
    divided = both.over(SQUARE, 4)
    assert divided.faces.tolist() == [[0, 1, 4], [0, 4, 2], [2, 4, 3], [4, 1, 3]]
    assert divided.corners.tolist() == [[1, 2, 2]]
    assert divided.weights.tolist() == [[2, 2, 0]]


def test_a_point_on_one_side_of_an_edge_alone_conforms_to_nothing():
    hanging = two_faces([(A, B, BC), (A, BC, C)], [(A, B, C)])
    assert hanging.is_tiling()
    assert not hanging.is_conforming(SQUARE)
    assert not two_faces(
        [(A, B, (0, 1, 3)), (A, (0, 1, 3), C)], [(A, (1, 3, 0), C), ((1, 3, 0), B, C)]
    ).is_conforming(SQUARE)


def test_a_seam_has_a_point_for_each_side():
    both = two_faces([(A, B, BC), (A, BC, C)], [(A, AB, C), (AB, B, C)])
    apart = np.array([[0, 1, 2], [5, 4, 3]])  # texture coordinates of the square
    assert len(both.over(apart, 6).corners) == 2


def test_points_inside_are_their_face_s_own_even_over_the_same_vertices():
    both = two_faces(FAN, FAN)
    twice = np.array([[0, 1, 2], [0, 1, 2]])
    assert both.over(twice, 3).faces.max() == 4


def test_corners_that_are_one_row_of_a_table_are_one():
    one_row = one_face(*RED).over(np.array([[3, 3, 3]]), 4)
    assert (one_row.faces == 3).all()
    two_rows = one_face(*FAN).over(np.array([[3, 1, 3]]), 4)
    assert two_rows.corners.tolist() == [[1, 3, 3]]
    assert two_rows.weights.tolist() == [[1, 3, 0]]


def test_what_divides_nothing_leaves_the_faces_as_they_are():
    none = Subdivision.none(2)
    assert none.is_tiling()
    assert none.is_conforming(SQUARE)
    assert not none.divided.any()
    assert none.over(SQUARE, 4).faces.tolist() == SQUARE.tolist()


@settings(max_examples=40, deadline=None)
@given(st.lists(st.integers(0, 10_000), min_size=1, max_size=10))
def test_any_points_inside_children_make_tilings_that_interpolate_exactly(picks):
    corners = [tuple(tuple(row) for row in np.eye(3, dtype=int) * 2**20)]
    for pick in picks:
        a, b, c = corners.pop(pick % len(corners))
        inside = tuple((2 * x + y + z) // 4 for x, y, z in zip(a, b, c, strict=True))
        corners += [(a, b, inside), (b, c, inside), (c, a, inside)]
    divided = one_face(*corners, exponent=20)
    assert divided.is_tiling()
    assert not one_face(*corners[1:], exponent=20).is_tiling()
    table = divided.over(np.array([[2, 0, 1]]), 3)
    values = np.array([[1.0], [5.0], [-3.0]])
    everything = np.concatenate([values, table.interpolated(values)])
    for face, child in zip(table.faces, corners, strict=True):
        for vertex, weights in zip(face, child, strict=True):
            exact = sum(
                Fraction(int(w), 2**20) * Fraction(float(values[v, 0]))
                for w, v in zip(weights, (2, 0, 1), strict=True)
            )
            assert Fraction(float(everything[vertex, 0])) == exact
