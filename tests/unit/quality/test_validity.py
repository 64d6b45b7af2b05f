"""Defects of a surface, each made and counted."""

from __future__ import annotations

import numpy as np

from meshcone.quality.records import Validity
from meshcone.quality.validity import inspect
from meshcone.surface import Mesh
from tests.meshes import noisy, sheet, sphere, torus


def counted(mesh: Mesh, before: Mesh | None = None) -> Validity:
    return inspect(mesh, 100_000, before)


def test_a_torus_is_a_valid_surface() -> None:
    assert counted(torus()) == Validity(
        watertight=True,
        boundary_edges=0,
        non_manifold_edges=0,
        opposed_edges=0,
        cracks=0,
        degenerate_faces=0,
        duplicate_faces=0,
        flipped_faces=None,
        self_intersections=0,
        components=1,
    )


def test_a_sheet_has_the_boundary_it_shows() -> None:
    found = counted(sheet(4, 6))

    assert not found.watertight
    assert found.boundary_edges == 2 * (3 + 5)


def test_defects_are_counted() -> None:
    mesh = sheet(3, 3)
    fin = np.array([[0, 4, 8]])
    broken = Mesh(mesh.vertices, np.concatenate([mesh.faces, mesh.faces[:1, [1, 2, 0]], fin]))

    found = counted(broken)

    assert found.duplicate_faces == 1
    assert found.degenerate_faces == 1
    assert found.non_manifold_edges > 0


def test_a_face_turned_around_opposes_its_neighbours() -> None:
    ball = sphere(2)
    turned = Mesh(ball.vertices, np.concatenate([ball.faces[:1, ::-1], ball.faces[1:]]))

    assert counted(turned).opposed_edges == 3


def test_a_vertex_pushed_over_its_neighbours_flips_faces_against_the_input() -> None:
    flat = sheet(5, 5)
    vertices = flat.vertices.copy()
    vertices[12] += [1.5, 0, 0]  # beyond the next vertex

    assert counted(flat.moved_to(vertices), flat).flipped_faces == 2
    assert counted(noisy(flat, 0.01), flat).flipped_faces == 0


def test_without_an_input_flipped_faces_are_not_tested() -> None:
    assert counted(sphere(1)).flipped_faces is None


def test_vertices_that_no_face_uses_are_no_component() -> None:
    ball = sphere(1)
    both = Mesh(
        np.concatenate([ball.vertices, ball.vertices + 3, [[9.0, 9.0, 9.0]]]),
        np.concatenate([ball.faces, ball.faces + len(ball.vertices)]),
    )

    assert counted(both).components == 2


def test_faces_that_the_mesh_no_longer_has_count_as_degenerate() -> None:
    assert inspect(sphere(2), 100_000, collapsed=2).degenerate_faces == 2
