"""Sources that cannot be refined where they lie, and those that can."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from meshcone.report.misfit import misfit
from meshcone.surface import Mesh
from tests.meshes import cylinder, noisy, sphere, torus

TORUS = torus()


def framed(mesh: Mesh) -> Mesh:
    """The mesh with its farthest vertex at distance 1."""
    return mesh.moved_to(mesh.vertices / np.linalg.norm(mesh.vertices, axis=1).max())


def falls(words: str | None) -> tuple[float, float]:
    """The distances before and after the motion that a sentence names."""
    assert words is not None
    found = re.search(r"would fall from (\S+) to (\S+) of", words)
    assert found is not None
    return float(found[1]), float(found[2])


REFERENCE = framed(TORUS)
ALONG_X = Rotation.from_euler("y", 90, degrees=True).as_matrix()
TURNED = Rotation.from_euler("xyz", [80, 20, 10], degrees=True).as_matrix()


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("factor", [1000.0, 0.001, 2.54, 0.3048])
def test_other_units_are_told_with_what_similarity_would_gain(factor: float, seed: int) -> None:
    source = noisy(REFERENCE, 0.005, seed)

    words = misfit(source.moved_to(factor * source.vertices), REFERENCE, 0, aligned=False)

    before, after = falls(words)
    assert after < 0.02 < 0.1 * before
    assert "align=similarity" in str(words)


@pytest.mark.parametrize("shift", [40.0, 1.2, 0.6])
def test_another_place_is_told_with_what_a_rigid_motion_would_gain(shift: float) -> None:
    source = noisy(REFERENCE, 0.005)

    words = misfit(
        source.moved_to(source.vertices + np.array([shift, 0, 0])), REFERENCE, 0, aligned=False
    )

    assert falls(words)[1] < 0.02
    assert "align=rigid" in str(words)


def bar(sections: int = 21) -> Mesh:
    """A square bar along x, closed, of radius 1."""
    return framed(
        Mesh(
            cylinder(4, sections, 0.1, 2.0).vertices @ ALONG_X.T,
            cylinder(4, sections, 0.1, 2.0).faces,
        )
    )


def slid(mesh: Mesh, x: float) -> Mesh:
    return mesh.moved_to(mesh.vertices + np.array([x, 0, 0]))


@pytest.mark.parametrize("sections", [21, 27])
def test_a_bar_slid_along_itself_is_told_though_it_lies_near(sections: int) -> None:
    words = misfit(slid(noisy(bar(sections), 0.001), 0.2), bar(), 0, aligned=False)

    assert falls(words)[1] < 0.005
    assert "align=rigid" in str(words)


def test_a_bar_in_place_fits_when_rough_or_slid_by_less_than_it_shows() -> None:
    assert misfit(noisy(bar(), 0.01), bar(), 0, aligned=False) is None
    assert misfit(slid(bar(), 0.01), bar(), 0, aligned=False) is None
    assert misfit(slid(bar(), 0.2), bar(), 0, aligned=True) is None


def test_a_shift_that_closest_points_find_back_fits() -> None:
    assert misfit(slid(noisy(REFERENCE, 0.005), 0.05), REFERENCE, 0, aligned=False) is None


def test_another_direction_is_told() -> None:
    source = noisy(REFERENCE, 0.005)

    words = misfit(source.moved_to(source.vertices @ TURNED.T), REFERENCE, 0, aligned=False)

    assert falls(words)[1] < 0.02


def test_a_source_inside_out_is_told_to_be_turned() -> None:
    inside_out = Mesh(REFERENCE.vertices, REFERENCE.faces[:, ::-1])

    words = misfit(noisy(inside_out, 0.01), REFERENCE, 0, aligned=False)

    assert words is not None
    assert re.match(r"\d+ % of the source's normals oppose the reference's", words)
    assert "turn the faces" in words


def test_what_lies_apart_after_aligning_is_not_told_to_be_aligned() -> None:
    away = REFERENCE.moved_to(REFERENCE.vertices + np.array([40.0, 0, 0]))

    assert misfit(away, REFERENCE, 0, aligned=True) == "They lie apart even after aligning."


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("sigma", [0.002, 0.02, 0.05])
def test_a_noisy_source_fits(sigma: float, seed: int) -> None:
    assert misfit(noisy(REFERENCE, sigma, seed), REFERENCE, 0, aligned=False) is None


def test_a_ball_that_is_to_become_a_ring_fits() -> None:
    assert misfit(sphere(3), REFERENCE, 0, aligned=False) is None


def test_a_source_of_which_the_reference_has_a_part_fits() -> None:
    half = Mesh(REFERENCE.vertices, REFERENCE.faces[REFERENCE.corners.mean(axis=1)[:, 0] > 0])

    assert misfit(REFERENCE, half, 0, aligned=False) is None
