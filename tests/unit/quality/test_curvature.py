"""Mean curvature of surfaces whose curvature is known."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from meshcone.quality.curvature import CurvatureField
from meshcone.quality.edge_uses import EdgeUses
from meshcone.surface import Mesh, sample_surface
from meshcone.surface.arrays import Floats
from tests.meshes import cylinder, noisy, sheet, sphere

RADIUS = 0.1


def saddle(first: float, second: float, cells: int = 160) -> Mesh:
    """The graph of (a x² + b y²) / 2 over a square of side 1, seen from above."""
    flat = sheet(cells + 1, cells + 1)
    x, y = (flat.vertices[:, :2] / cells - 0.5).T
    return Mesh(np.stack([x, y, (first * x**2 + second * y**2) / 2], axis=1), flat.faces)


def field(mesh: Mesh) -> CurvatureField:
    return CurvatureField(EdgeUses.of(mesh))


def curvature(mesh: Mesh, points: Floats) -> Floats:
    return field(mesh).at(points, RADIUS)


@pytest.mark.parametrize("radius", [0.5, 1.0, 3.0])
def test_a_sphere_has_the_inverse_of_its_radius_everywhere(radius: float) -> None:
    ball = sphere(5).moved_to(sphere(5).vertices * radius)
    points = sample_surface(ball, 200, seed=0).points

    found = field(ball).at(points, RADIUS * radius) * radius

    assert found.mean() == pytest.approx(1, rel=0.002)
    assert found.std() < 0.02


def test_a_cylinder_has_half_the_inverse_of_its_radius_away_from_its_rims() -> None:
    tube = cylinder(sides=200, rings=100, radius=1.0, height=4.0)
    points = sample_surface(tube, 500, seed=0).points

    found = curvature(tube, points[np.abs(points[:, 2]) < 1.8])

    assert found.mean() == pytest.approx(0.5, rel=0.005)
    assert found.std() < 0.02


# Seen from above a bowl is concave, and a positive curvature is that of a dome.
@pytest.mark.parametrize(("first", "second"), [(1, -1), (1, -0.2), (0.5, -1.5), (-0.5, -1)])
def test_the_middle_of_a_saddle_or_dome_has_the_mean_of_its_principal_curvatures(
    first: float, second: float
) -> None:
    middle = np.zeros((1, 3))

    found = curvature(saddle(first, second), middle)

    assert found[0] == pytest.approx(-(first + second) / 2, abs=0.01)


def test_a_plane_has_none_however_it_is_cut() -> None:
    fine, coarse = sheet(40, 40), Mesh(np.eye(4, 3) * 39, np.array([[3, 0, 1]]))
    points = np.array([[10.0, 10.0, 0.0], [0.0, 0.0, 0.0], [5.0, 0.0, 0.0]])

    for mesh in (fine, coarse):
        assert field(mesh).at(points, 3.0) == pytest.approx(0)


def test_a_sharp_edge_has_the_same_curvature_in_a_coarse_and_in_a_fine_mesh() -> None:
    def roof(cells: int) -> Mesh:
        flat = sheet(2 * cells + 1, 2 * cells + 1)
        x, y = (flat.vertices[:, :2] / cells - 1).T
        return Mesh(np.stack([x, y, -np.abs(x)], axis=1), flat.faces)

    ridge = np.array([[0.0, 0.0, 0.0], [0.0, 0.5, 0.0]])
    # A quarter turn over the ball's diameter, halved, over the area of a disc.
    expected = (np.pi / 2) * (2 * RADIUS) / 2 / (np.pi * RADIUS**2)

    assert curvature(roof(1), ridge) == pytest.approx(expected)
    assert curvature(roof(32), ridge) == pytest.approx(expected)


def test_an_open_border_adds_nothing() -> None:
    upper = sphere(5)
    upper = Mesh(upper.vertices, upper.faces[upper.corners[:, :, 2].min(axis=1) >= 0])
    border = upper.vertices[np.abs(upper.vertices[:, 2]) < 1e-9]

    found = curvature(upper, border)

    # There is half a disc of the surface, and no more than its share of the curvature; the
    # angles along the border itself, a part of it, are gone.
    assert len(found) > 0
    assert 0.35 < found.min() <= found.max() < 0.5


def test_a_face_turned_against_its_neighbours_has_no_say() -> None:
    flat = sheet(3, 3)
    turned = Mesh(flat.vertices, np.concatenate([flat.faces[:1, ::-1], flat.faces[1:]]))

    assert field(turned).at(flat.vertices, 1.0) == pytest.approx(0)


def test_a_ball_adds_up_the_angles_of_all_edges_that_trimesh_finds_in_it() -> None:
    mesh = noisy(sphere(3), 0.03)
    made = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    angles = made.face_adjacency_angles * np.where(made.face_adjacency_convex, 1, -1)
    start, end = (mesh.vertices[side] for side in made.face_adjacency_edges.T)
    shares = (np.arange(2000) + 0.5) / 2000
    along = start[:, None] + shares[:, None] * (end - start)[:, None]
    points, radius = mesh.vertices[::100], 0.3

    within = [np.mean(np.linalg.norm(along - p, axis=2) < radius, axis=1) for p in points]
    expected = np.array(within) @ (angles * np.linalg.norm(end - start, axis=1))

    found = field(mesh).at(points, radius)
    np.testing.assert_allclose(found, expected / (2 * np.pi * radius**2), atol=0.01)


def test_a_surface_without_an_edge_that_bends_is_flat_everywhere() -> None:
    assert not curvature(sheet(4, 4), np.zeros((2, 3))).any()
