"""Vertices of open borders that lie on an edge of one are found, and where they leave it."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.quality.contacts import border_contacts
from meshcone.surface import Mesh
from tests.meshes import joined_halves, sheet, sphere

PAIRS = 100_000


def test_vertices_within_an_edge_of_the_other_side_are_found_with_their_place() -> None:
    found = border_contacts(joined_halves(2, 4), PAIRS)

    assert found.inside.sum() == 2
    np.testing.assert_allclose(found.shares[found.inside], 0.5)
    np.testing.assert_allclose(found.gaps, 0, atol=1e-15)


@pytest.mark.parametrize(("gap", "count"), [(9e-5, 2), (2e-4, 0)])
def test_what_lies_no_farther_apart_than_a_seam_may_be_open_counts(gap: float, count: int) -> None:
    assert border_contacts(joined_halves(2, 4, gap), PAIRS).inside.sum() == count


@pytest.mark.parametrize("mesh", [sphere(1), sheet(4, 4)], ids=["closed", "one border"])
def test_a_mesh_without_a_seam_has_none(mesh: Mesh) -> None:
    assert not len(border_contacts(mesh, PAIRS).vertices)


def test_the_tip_of_a_needle_does_not_lie_on_the_side_across() -> None:
    needle = Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [0.5, 1e-6, 0]]), np.array([[0, 1, 2]]))

    assert not len(border_contacts(needle, PAIRS).vertices)


def test_a_mesh_far_smaller_than_the_gap_touches_itself_nowhere() -> None:
    tiny = sheet(20, 20)

    assert not len(border_contacts(tiny.moved_to(1e-6 * tiny.vertices), PAIRS).vertices)


def test_a_hole_that_has_shrunk_to_a_line_does_not_lie_on_itself() -> None:
    holed = sheet(4, 4)
    hole = (np.abs(holed.corners.mean(axis=1)[:, :2] - 1.5) < 0.5).all(axis=1)
    shrunk = holed.vertices.copy()
    shrunk[[5, 6, 10, 9]] = 1.5 + np.outer([0, 2.2, 3.1, 0.8], [1e-5, 1e-5, 0])  # around it

    assert not len(border_contacts(Mesh(shrunk, holed.faces[~hole]), PAIRS).vertices)


def test_nothing_is_found_where_there_are_too_many_edges_to_compare() -> None:
    assert not len(border_contacts(joined_halves(2, 4), 3).vertices)


def test_a_vertex_that_leaves_its_edge_has_opened_the_border() -> None:
    mesh = joined_halves(2, 4)
    found = border_contacts(mesh, PAIRS)
    moved = mesh.vertices.copy()
    [first, _] = found.vertices[found.inside]
    moved[first, 2] += 0.01

    opened, gaps = found.opened(moved)

    assert set(found.vertices[opened]) == {first}
    assert gaps[opened] == pytest.approx(0.01)


def test_a_border_that_slides_along_the_other_opens_nothing() -> None:
    mesh = joined_halves(2, 4)
    found = border_contacts(mesh, PAIRS)
    moved = mesh.vertices.copy()
    moved[found.vertices[found.inside], 1] += 0.1

    assert not found.opened(moved)[0].any()


def test_rounding_by_a_coarse_file_does_not_open_a_border() -> None:
    mesh = joined_halves(2, 4)
    steps = Mesh(mesh.vertices, mesh.faces, precision=np.full(len(mesh.vertices), 0.001))
    found = border_contacts(steps, PAIRS)
    moved = np.where(
        mesh.vertices[:, :1] > 1, mesh.vertices + np.array([0.0015, 0, 0]), mesh.vertices
    )
    moved[found.vertices] += [0.0015, 0, 0]

    assert len(found.vertices)
    assert not found.opened(moved)[0].any()
    assert border_contacts(mesh, PAIRS).opened(moved)[0].any()
