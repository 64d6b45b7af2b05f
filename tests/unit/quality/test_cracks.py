"""Open borders that run along each other are counted."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.quality.cracks import count_cracks
from meshcone.surface import Mesh
from tests.meshes import joined_halves, sheet, sphere

PAIRS = 100_000


def coarse(mesh: Mesh, step: float) -> Mesh:
    return Mesh(mesh.vertices, mesh.faces, precision=np.full(len(mesh.vertices), step))


def halves(gap: float, left: int = 6, right: int = 6) -> Mesh:
    """Two unit squares side by side, of so many cells along each side."""
    meshes = [sheet(cells + 1, cells + 1) for cells in (left, right)]
    one = meshes[0].vertices / left
    other = meshes[1].vertices / right + np.array([1.0 + gap, 0, 0])
    faces = np.concatenate([meshes[0].faces, meshes[1].faces + len(one)])
    return Mesh(np.concatenate([one, other]), faces)


@pytest.mark.parametrize("gap", [0.0, 5e-8, 9e-5])
def test_both_sides_of_a_seam_count(gap: float) -> None:
    assert count_cracks(halves(gap), PAIRS) == 12


@pytest.mark.parametrize("gap", [1.1e-4, 0.03])
def test_borders_farther_apart_do_not(gap: float) -> None:
    assert count_cracks(halves(gap), PAIRS) == 0


def test_borders_divided_otherwise_count_all_the_same() -> None:
    assert count_cracks(halves(1e-5, left=6, right=15), PAIRS) == 6 + 15


@pytest.mark.parametrize(("left", "right"), [(4, 8), (4, 16), (4, 6), (3, 9), (1, 2)])
def test_borders_that_share_the_vertices_they_have_in_common_count_as_well(
    left: int, right: int
) -> None:
    assert count_cracks(joined_halves(left, right), PAIRS) == left + right


def test_a_needle_at_a_border_is_no_crack() -> None:
    needle = Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [1, 9e-5, 0]]), np.array([[0, 1, 2]]))

    assert count_cracks(needle, PAIRS) == 0


@pytest.mark.parametrize(("width", "count"), [(5e-5, 2), (0.01, 0)])
def test_the_sides_of_a_slit_count_to_its_very_end(width: float, count: int) -> None:
    vertices = [[0, 0, 0], [1, -width / 2, 0], [1, width / 2, 0], [0, -1, 0], [0, 1, 0]]
    mesh = Mesh(np.array(vertices, dtype=float), np.array([[0, 3, 1], [0, 2, 4]]))

    assert count_cracks(mesh, PAIRS) == count


@pytest.mark.parametrize("mesh", [sphere(2), sheet(5, 5)], ids=["closed", "one border"])
def test_a_mesh_without_a_seam_has_none(mesh: Mesh) -> None:
    assert count_cracks(mesh, PAIRS) == 0


def test_what_would_take_too_long_is_not_tested() -> None:
    assert count_cracks(halves(0.0), 3) is None


@pytest.mark.parametrize(("step", "count"), [(0.001, 12), (0.0005, 0)])
def test_sides_that_a_coarse_file_rounded_apart_are_cracks(step: float, count: int) -> None:
    assert count_cracks(coarse(halves(0.003), step), PAIRS) == count


def test_steps_as_coarse_as_the_edges_make_no_cracks() -> None:
    assert count_cracks(coarse(halves(0.05), 0.1), PAIRS) == 0
