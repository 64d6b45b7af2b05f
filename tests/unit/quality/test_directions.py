"""Distances each way apart, signed ones, shares of the area and their histogram."""

from __future__ import annotations

import numpy as np
import pytest
import pyvista
import trimesh

from meshcone.quality.directions import BINS, directions, inside
from meshcone.quality.records import Directions
from meshcone.quality.sampled import SampledSurface, Sampling
from meshcone.surface import Frame, Mesh, sample_surface
from tests import shapes

FRAME = Frame(np.zeros(3), 1.0)
SAMPLING = Sampling(samples=2000, emd_samples=64, curvature_samples=64)
SPHERE = Mesh(*shapes.sphere(3, 1.0))


def box(side: float) -> Mesh:
    """Twelve triangles."""
    made = trimesh.creation.box((side, side, side))
    return Mesh(np.asarray(made.vertices, dtype=float), np.asarray(made.faces, dtype=np.int64))


def plate(height: float) -> Mesh:
    corners = np.array([[0, 0, height], [1, 0, height], [1, 1, height], [0, 1, height]])
    return Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]))


def found(
    mesh: Mesh, reference: Mesh, bound: float | None = None, *, closed: bool = True
) -> Directions:
    surface, other = (
        SampledSurface(each, SAMPLING, seed) for seed, each in enumerate((mesh, reference))
    )
    return directions(surface, other, FRAME, bound, closed=closed)


def distance_to_cube(points: np.ndarray) -> np.ndarray:
    """Signed distance to the cube from -1 to 1, negative inside (Quilez, "Distance functions")."""
    beyond = np.abs(points) - 1
    outside = np.linalg.norm(np.maximum(beyond, 0), axis=1)
    return outside + np.minimum(beyond.max(axis=1), 0)


def test_the_side_of_a_cube_of_twelve_triangles_is_right_at_its_edges_and_corners() -> None:
    rng = np.random.default_rng(0)
    corners = rng.choice([-1.0, 1.0], (4000, 3))
    edges = np.where(rng.random((4000, 3)) < 0.4, rng.uniform(-1, 1, (4000, 3)), corners)
    points = edges + rng.normal(scale=0.05, size=edges.shape)

    assert np.array_equal(inside(points, box(2.0)), distance_to_cube(points) < 0)


def test_signed_distances_are_those_of_the_formula() -> None:
    mesh = box(2.0).moved_to(box(2.0).vertices * 1.1 + [0.05, -0.02, 0])

    signed = found(mesh, box(2.0)).signed

    exact = distance_to_cube(sample_surface(mesh, 200_000, 5).points)
    assert signed is not None
    assert signed.mean == pytest.approx(exact.mean(), abs=1e-3)
    assert signed.p5 == pytest.approx(np.quantile(exact, 0.05), abs=3e-3)
    assert signed.p95 == pytest.approx(np.quantile(exact, 0.95), abs=3e-3)


def test_a_smaller_box_lies_inside() -> None:
    signed = found(box(1.8), box(2.0)).signed

    assert signed is not None
    assert (signed.mean, signed.p5, signed.p95) == pytest.approx((-0.1, -0.1, -0.1))


@pytest.mark.parametrize("seed", range(3))
def test_another_library_finds_the_same_side(seed: int) -> None:
    rng = np.random.default_rng(seed)
    body = SPHERE.moved_to(shapes.noisy(SPHERE.vertices, 0.05, seed=seed) * [1.0, 0.6, 0.3])
    points = rng.uniform(-1, 1, (3000, 3))

    cells = np.column_stack([np.full(len(body.faces), 3), body.faces]).ravel()
    surface = pyvista.PolyData(body.vertices, cells)
    theirs = pyvista.PolyData(points).compute_implicit_distance(surface)["implicit_distance"]

    clear = np.abs(theirs) > 1e-3
    assert np.array_equal(inside(points, body)[clear], theirs[clear] < 0)


def test_a_cube_inside_out_has_the_same_inside() -> None:
    turned = Mesh(box(2.0).vertices, box(2.0).faces[:, ::-1])

    assert inside(np.array([[0.0, 0, 0], [3, 0, 0]]), turned).tolist() == [True, False]


def test_what_a_mesh_lacks_and_what_it_has_besides_are_told_apart() -> None:
    upper = Mesh(SPHERE.vertices, SPHERE.faces[SPHERE.corners.mean(axis=1)[:, 2] > 0])

    half = found(upper, SPHERE)
    whole = found(SPHERE, upper, closed=False)

    assert half.extra.max < 1e-12 < 0.5 < half.missing.max
    assert half.missing.at[2] == pytest.approx(-1, abs=0.01)
    assert whole.missing.max < 1e-12 < 0.5 < whole.extra.max
    assert half.missing.beyond_percent == pytest.approx(0.5, abs=0.05)
    assert whole.signed is None


def test_a_share_of_the_area_is_farther_than_a_bound() -> None:
    apart = found(plate(0.005), plate(0.0), 0.004, closed=False)

    assert (apart.missing.beyond_permille, apart.missing.beyond_percent) == (1.0, 0.0)
    assert apart.extra.beyond_bound == 1.0
    assert found(plate(0.005), plate(0.0), closed=False).extra.beyond_bound is None
    assert apart.extra.mean == apart.extra.rms == pytest.approx(0.005)


def test_a_histogram_holds_all_of_both_surfaces() -> None:
    bins = found(SPHERE.moved_to(shapes.noisy(SPHERE.vertices, 0.05)), SPHERE).histogram

    assert len(bins.missing) == len(bins.extra) == BINS == 64
    assert sum(bins.missing) == pytest.approx(1)
    assert sum(bins.extra) == pytest.approx(1)
    assert bins.missing[-1] + bins.extra[-1] > 0


def test_a_histogram_of_nothing_but_zeros_is_all_in_the_first_bin() -> None:
    bins = found(plate(0.0), plate(0.0), closed=False).histogram

    assert bins.upper == 0
    assert (bins.missing[0], bins.extra[0]) == (1.0, 1.0)
