"""Dividing a source level by level where it misses its reference."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.detail.levels import Detail, find_detail
from meshcone.detail.misses import Misses, Target
from meshcone.options import Options, parse_options
from meshcone.quality.intersections import count_self_intersections
from meshcone.surface import Mesh
from tests import shapes

SOURCE, REFERENCE = (Mesh(*shapes.sphere(level, 1.0)) for level in (2, 4))


def found(options: Options, divisible: np.ndarray | None = None) -> Detail:
    every = np.ones(len(SOURCE.faces), dtype=bool)
    return find_detail(SOURCE, REFERENCE, every if divisible is None else divisible, options)


def detail(**options: object) -> Options:
    return parse_options({"detail": options})


def hill(cells: int) -> Mesh:
    """A square of so many cells a side, flat but for a hill in one corner."""
    x, y = np.meshgrid(*[np.linspace(0, 1, cells + 1)] * 2)
    height = 0.3 * np.exp(-20 * ((x - 0.8) ** 2 + (y - 0.8) ** 2))
    vertices = np.stack([x, y, height], axis=-1).reshape(-1, 3)
    corner = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    across = corner + cells + 2
    faces = [[corner, corner + 1, across], [corner, across, across - 1]]
    return Mesh(vertices, np.concatenate([np.stack(each, axis=1) for each in faces]))


def test_the_budget_is_spent_where_the_surface_bends() -> None:
    source = hill(8)
    every = np.ones(len(source.faces), dtype=bool)
    divided = find_detail(source, hill(64), every, detail(growth=2.5))
    assert divided.stopped == "budget"
    assert 0.97 * 320 <= len(divided.subdivision.parents) <= 320
    children = np.bincount(divided.subdivision.parents)
    on_hill = (source.corners.mean(axis=1)[:, :2] > 0.5).all(axis=1)
    assert children[on_hill].mean() > 2.5 * children[~on_hill].mean()


@pytest.mark.parametrize("faces", [1, 2])
def test_a_source_of_a_face_or_two_gets_as_many_as_are_allowed(faces: int) -> None:
    flat = hill(1)
    source = Mesh(flat.vertices, flat.faces[:faces])
    divided = find_detail(source, hill(64), np.ones(faces, dtype=bool), detail(growth=16))
    assert divided.stopped == "budget"
    assert 15 * faces <= len(divided.subdivision.parents) <= 16 * faces


def test_what_is_found_tiles_the_source_without_gaps() -> None:
    divided = found(detail(growth=3)).subdivision
    assert divided.is_tiling()
    assert divided.is_conforming(SOURCE.faces)


def test_each_budget_comes_closer_than_a_smaller_one() -> None:
    target = Target.of(REFERENCE, 0)
    reached = []
    for growth in (1.5, 3, 6):
        divided = found(detail(growth=growth))
        corners = divided.corners.reshape(-1, 3)
        mesh = Mesh(corners, np.arange(len(corners)).reshape(-1, 3))
        reached.append(Misses.of(mesh, target).mean)
    assert reached[0] > 1.5 * reached[1] > 2 * reached[2]


def test_it_stops_where_every_sample_is_within_the_tolerance() -> None:
    divided = found(detail(growth=64, tolerance=0.01))
    assert divided.stopped == "tolerance"
    assert len(divided.subdivision.parents) < 10 * len(SOURCE.faces)


def test_faces_that_are_to_stay_whole_do() -> None:
    divisible = SOURCE.corners.mean(axis=1)[:, 2] > 0
    divided = found(detail(growth=2), divisible).subdivision
    assert divided.divided.any()
    assert not divided.divided[~divisible].any()


def test_a_source_that_follows_its_reference_already_is_left_alone() -> None:
    same = np.ones(len(REFERENCE.faces), dtype=bool)
    divided = find_detail(REFERENCE, REFERENCE, same, detail(growth=2))
    assert divided.levels == 0
    assert not divided.subdivision.divided.any()


def test_the_same_pair_is_divided_in_the_same_way_again() -> None:
    one, other = (found(detail(growth=2)) for _ in range(2))
    assert np.array_equal(one.subdivision.corners, other.subdivision.corners)
    assert np.array_equal(one.corners, other.corners)


@pytest.mark.parametrize("asked", [0, 1, 127])
def test_a_limit_below_the_source_s_own_faces_takes_none_away(asked: int) -> None:
    allowed = parse_options({"detail": {"max_faces": max(asked, 1)}}).detail.faces_allowed(128)
    assert allowed == 128


def sheets() -> tuple[Mesh, Mesh]:
    """Two hills one through the other here and there, coarse and fine."""
    made = []
    for cells in (8, 48):
        one = hill(cells)
        above = one.vertices * [1, 1, 0.6] + [0.03, 0.02, 0.09]
        both = np.concatenate([one.vertices, above])
        made.append(Mesh(both, np.concatenate([one.faces, one.faces + len(one.vertices)])))
    return made[0], made[1]


def test_faces_that_would_pass_through_others_are_left_whole() -> None:
    """The finer surface crosses itself six times as often, and its copy need not."""
    source, reference = sheets()
    every = np.ones(len(source.faces), dtype=bool)
    divided = find_detail(source, reference, every, detail(growth=3))
    points, faces = np.unique(divided.corners.reshape(-1, 3), axis=0, return_inverse=True)
    after = count_self_intersections(Mesh(points, faces.reshape(-1, 3)), 10**7)
    assert divided.levels > 0
    assert after <= 2 * count_self_intersections(source, 10**7)


def test_a_part_that_the_reference_lacks_gets_no_faces() -> None:
    ball, count = SOURCE, len(SOURCE.vertices)
    part = Mesh(*shapes.sphere(1, 0.2))
    beside = np.concatenate([ball.vertices, part.vertices + np.array([1.6, 0, 0])])
    source = Mesh(beside, np.concatenate([ball.faces, part.faces + count]))
    divided = find_detail(
        source, REFERENCE, np.ones(len(source.faces), dtype=bool), detail(growth=2)
    )
    assert divided.stopped == "budget"
    assert not divided.subdivision.divided[len(ball.faces) :].any()
