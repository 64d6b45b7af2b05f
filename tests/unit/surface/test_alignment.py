from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from meshcone.surface import Mesh, SurfaceTree
from meshcone.surface.alignment import Alignment, AlignmentMode, align
from meshcone.surface.arrays import Floats
from meshcone.surface.similarity import invert, scale_of, similarity, transform_points
from tests import meshes

TILTED = Rotation.from_euler("xyz", [70, -40, 130], degrees=True)
SHIFT = np.array([0.4, -0.7, 0.2])


def pear() -> Mesh:
    """An egg with a bump off every axis: no rotation maps it to itself."""
    ball = meshes.sphere(3)
    bump = np.exp(6 * (ball.vertices @ [0.48, 0.6, 0.64] - 1))
    return ball.moved_to(ball.vertices * [1.4, 1.0, 0.7] * (1 + 0.5 * bump[:, None]))


def displaced(mesh: Mesh, rotation: Rotation, scale: float = 1.0) -> Mesh:
    return mesh.moved_to(
        transform_points(similarity(rotation.as_matrix(), scale, np.zeros(3), SHIFT), mesh.vertices)
    )


def shuffled(mesh: Mesh) -> Mesh:
    """The same surface, but no two faces at the same place in the list."""
    return Mesh(mesh.vertices, np.roll(mesh.faces, 5, axis=0))


def residual(found: Alignment, source: Mesh, reference: Mesh) -> float:
    moved = transform_points(found.matrix, source.vertices[np.unique(source.faces)])
    return float(np.sqrt(np.mean(SurfaceTree(reference).closest(moved).distances ** 2)))


@pytest.mark.parametrize("mode", ["rigid", "similarity"])
def test_meshes_that_correspond_are_aligned_in_closed_form(mode: AlignmentMode) -> None:
    source = displaced(pear(), TILTED, 1.0 if mode == "rigid" else 25.4)

    found = align(source, pear(), mode, seed=0)

    assert found.method == "correspondence"
    assert residual(found, source, pear()) < 1e-12


@pytest.mark.parametrize("scale", [25.4, 1 / 25.4, 1000.0])
def test_other_units_are_found(scale: float) -> None:
    source = shuffled(displaced(pear(), TILTED, scale))

    found = align(source, pear(), "similarity", seed=0)

    assert (found.method, found.note) == ("icp", None)
    assert scale_of(found.matrix) == pytest.approx(1 / scale, rel=1e-5)
    assert residual(found, source, pear()) < 1e-5


@pytest.mark.parametrize("axis", ["x", "y", "z"])
@pytest.mark.parametrize("degrees", [90, 180])
def test_a_turn_is_found(axis: str, degrees: float) -> None:
    source = shuffled(displaced(pear(), Rotation.from_euler(axis, degrees, degrees=True)))

    found = align(source, pear(), "rigid", seed=0)

    assert residual(found, source, pear()) < 1e-5
    assert scale_of(found.matrix) == pytest.approx(1)


def test_a_symmetric_shape_is_brought_to_the_surface() -> None:
    source = shuffled(displaced(meshes.torus(), TILTED))

    found = align(source, meshes.torus(), "rigid", seed=0)

    assert residual(found, source, meshes.torus()) < 1e-4
    assert found.after < found.before / 1000


def test_noise_does_not_mislead() -> None:
    source = shuffled(displaced(meshes.noisy(pear(), 0.02), TILTED))

    found = align(source, pear(), "similarity", seed=0)

    assert residual(found, source, pear()) < 0.021


def test_a_source_that_lacks_a_part_is_aligned_by_the_rest() -> None:
    whole = pear()
    kept = whole.corners.mean(axis=1)[:, 1] < 0.5
    source = displaced(Mesh(whole.vertices, whole.faces[kept]), TILTED)

    found = align(source, whole, "rigid", seed=0)

    assert kept.mean() < 0.85
    assert residual(found, source, whole) < 1e-3


@pytest.mark.parametrize("degrees", [2, 10, 25])
def test_a_tilted_sheet_is_turned_back_and_not_on_and_over(degrees: int) -> None:
    corners = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0.0]])
    sheet = Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]))
    tilt = Rotation.from_rotvec(np.radians(degrees) * np.array([0.6, 0.8, 0])).as_matrix()
    source = Mesh(corners @ tilt.T, np.array([[1, 2, 3], [1, 3, 0]]))

    found = align(source, sheet, "rigid", seed=0)

    np.testing.assert_allclose(found.matrix[:3, :3], tilt.T, atol=5e-3)


def test_a_mirror_image_is_never_the_answer() -> None:
    mirrored = pear().moved_to(pear().vertices * [-1.0, 1.0, 1.0])

    for source in (mirrored, shuffled(mirrored)):
        assert np.linalg.det(align(source, pear(), "rigid", seed=0).matrix) > 0


@pytest.mark.parametrize("amount", [0.0, 0.02])
def test_a_source_in_place_stays_there(amount: float) -> None:
    in_place = meshes.noisy(pear(), amount)

    for source in (in_place, shuffled(in_place)):
        found = align(source, pear(), "similarity", seed=0)

        np.testing.assert_array_equal(found.matrix, np.eye(4))
        assert (found.method, found.before) == ("none", found.after)
        assert found.note is not None
        assert "stays in place" in found.note


def test_distances_are_in_model_units() -> None:
    shift = [3.0, 0, 0]
    flat = meshes.sheet(30, 30)
    found = align(flat.moved_to(flat.vertices + shift), flat, "rigid", seed=0)

    np.testing.assert_allclose(found.matrix[:3, 3], [-3, 0, 0], atol=1e-9)
    assert 0 <= found.after < 1e-9


def test_the_same_seed_gives_the_same_answer() -> None:
    source = shuffled(displaced(meshes.noisy(pear(), 0.02), TILTED))

    first, second = (align(source, pear(), "similarity", seed=3) for _ in range(2))

    np.testing.assert_array_equal(first.matrix, second.matrix)


def test_a_similarity_is_inverted() -> None:
    matrix = similarity(TILTED.as_matrix(), 25.4, np.ones(3), SHIFT)
    points: Floats = pear().vertices

    back = transform_points(invert(matrix), transform_points(matrix, points))

    np.testing.assert_allclose(back, points, atol=1e-12)
    np.testing.assert_allclose(transform_points(matrix, np.ones((1, 3)))[0], SHIFT)
