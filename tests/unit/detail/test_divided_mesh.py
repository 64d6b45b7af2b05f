"""Edges split, and the faces beside them so that they still fit together."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meshcone.detail.divided_mesh import DividedMesh, edge_of_sides
from meshcone.surface import Mesh
from tests import shapes

TRIANGLE = Mesh(np.array([[0.0, 0, 0], [4, 0, 0], [1, 3, 0]]), np.array([[0, 1, 2]]))


def square_and_flap() -> Mesh:
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0.5, 1]])
    return Mesh(vertices, np.array([[0, 1, 2], [0, 2, 3], [2, 1, 4]]))


@pytest.mark.parametrize("marks", range(8))
def test_each_split_side_adds_a_face(marks: int) -> None:
    marked = np.array([bool(marks >> k & 1) for k in range(3)])
    split = DividedMesh.of(TRIANGLE).split(marked)
    assert len(split.mesh.faces) == 1 + marked.sum()
    assert split.subdivision().is_tiling()
    assert split.mesh.face_areas.sum() == pytest.approx(TRIANGLE.face_areas.sum())


def test_the_shorter_diagonal_is_drawn() -> None:
    long_way = Mesh(np.array([[0.0, 0, 0], [6, 0, 0], [5, 1, 0]]), np.array([[0, 1, 2]]))
    sides = edge_of_sides(long_way)[0]
    marked = np.zeros(3, dtype=bool)
    marked[sides[:2]] = True
    split = DividedMesh.of(long_way).split(marked).mesh
    middles = np.array([[3.0, 0, 0], [5.5, 0.5, 0]])
    diagonals = [np.linalg.norm(long_way.vertices[2] - middles[0]), np.linalg.norm(middles[1])]
    assert np.isclose(split.edge_lengths, min(diagonals)).any()
    assert not np.isclose(split.edge_lengths, max(diagonals)).any()


@settings(max_examples=30, deadline=None)
@given(st.lists(st.integers(0, 2**31 - 1), min_size=1, max_size=4))
def test_any_edges_split_leave_a_mesh_that_conforms(seeds: list[int]) -> None:
    mesh = square_and_flap()
    divided = DividedMesh.of(mesh)
    for seed in seeds:
        generator = np.random.default_rng(seed)
        marked = generator.random(len(divided.mesh.edges)) < generator.random()
        faces = len(divided.mesh.faces) + marked[edge_of_sides(divided.mesh)].sum()
        divided = divided.split(marked)
        assert len(divided.mesh.faces) == faces
    found = divided.subdivision()
    assert found.is_tiling()
    assert found.is_conforming(mesh.faces)
    table = found.over(mesh.faces, len(mesh.vertices))
    points = np.concatenate([mesh.vertices, table.interpolated(mesh.vertices)])
    assert np.allclose(points[table.faces], divided.mesh.corners)


def test_splitting_a_closed_surface_leaves_it_closed() -> None:
    mesh = Mesh(*shapes.sphere(1))
    divided = DividedMesh.of(mesh).split(np.arange(len(mesh.edges)) % 3 == 0)
    assert not divided.mesh.border_sides.any()


def test_the_record_is_in_its_lowest_terms() -> None:
    divided = DividedMesh.of(TRIANGLE).split(np.zeros(3, dtype=bool))
    assert divided.exponent == 1
    assert divided.subdivision().exponent == 0
