"""Surfaces whose gaps are closed by faces without area, as writers of CAD models do it."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from meshcone.quality.closest_normals import ClosestNormals
from meshcone.quality.curvature import CurvatureField
from meshcone.quality.edge_uses import EdgeUses
from meshcone.surface import Mesh, SurfaceTree, sample_surface
from meshcone.surface.arrays import Floats
from tests.meshes import closed_by_thin_faces

MADE = trimesh.creation.box((2, 3, 4))
BOX = Mesh(np.asarray(MADE.vertices), np.asarray(MADE.faces))
ASLANT = Rotation.from_rotvec([0.3, 0.5, 0.7]).as_matrix()
TURNED = BOX.moved_to(BOX.vertices @ ASLANT.T + [5, 0, 0])


def in_32_bits(mesh: Mesh) -> Mesh:
    return mesh.moved_to(mesh.vertices.astype(np.float32))


CLOSED = {
    "by the axes": (closed_by_thin_faces(BOX), BOX),
    "aslant": (closed_by_thin_faces(TURNED), TURNED),
    "in 32 bits": (in_32_bits(closed_by_thin_faces(TURNED)), in_32_bits(TURNED)),
    "by faces the other way round": (closed_by_thin_faces(TURNED, turned=True), TURNED),
}


def along_edges(mesh: Mesh) -> Floats:
    """Points a quarter of the way along all edges."""
    start, end = mesh.vertices[mesh.edges[:, 0]], mesh.vertices[mesh.edges[:, 1]]
    return 0.75 * start + 0.25 * end


@pytest.mark.parametrize("name", CLOSED)
def test_curvature_is_that_of_the_surface_without_them(name: str) -> None:
    closed, plain = CLOSED[name]
    points = along_edges(plain)

    found, expected = (
        CurvatureField(EdgeUses.of(mesh)).at(points, radius=0.5) for mesh in (closed, plain)
    )

    assert expected.max() > 0.1
    np.testing.assert_allclose(found, expected, atol=1e-5)


@pytest.mark.parametrize("name", CLOSED)
def test_each_bent_edge_is_one(name: str) -> None:
    closed, _ = CLOSED[name]

    met = EdgeUses.of(closed).meetings()

    normals = closed.face_normals
    bent = np.abs(np.sum(normals[met.first] * normals[met.second], axis=1)) < 0.1
    assert len(np.unique(met.edges[bent])) == 12
    assert np.linalg.norm(met.end - met.start, axis=1)[bent].sum() == pytest.approx(4 * (2 + 3 + 4))


@pytest.mark.parametrize("name", CLOSED)
def test_normals_beyond_an_edge_are_found_across_them(name: str) -> None:
    """From a larger box around it much of a box is closest at its edges."""
    closed, plain = CLOSED[name]
    middle = plain.vertices.mean(axis=0)
    around = sample_surface(plain.moved_to(middle + 1.1 * (plain.vertices - middle)), 500, seed=0)
    closest = SurfaceTree(closed).closest(around.points)

    chords = ClosestNormals(EdgeUses.of(closed)).chords(around.normals, closest)

    assert chords.max() < 1e-5


def test_a_fan_of_them_pairs_each_part_of_the_long_side_with_the_face_beyond() -> None:
    """A long side on the left, three parts on the right, and two faces without area between."""
    vertices = np.array(
        [[0, 0, 0], [0, 3, 0], [0, 1, 0], [0, 2, 0], [-1, 1, -1], [1, 1, -1]], dtype=float
    )
    beyond = [[0, 2, 5], [2, 3, 5], [3, 1, 5]]
    mesh = Mesh(vertices, np.array([[1, 0, 4], *beyond, [0, 1, 2], [2, 1, 3]]))

    met = EdgeUses.of(mesh).meetings()

    across = np.flatnonzero((met.first == 0) | (met.second == 0))
    pairs = {
        (frozenset((int(met.first[k]), int(met.second[k]))), float(met.start[k, 1] + met.end[k, 1]))
        for k in across
    }
    assert pairs == {(frozenset((0, 1)), 1.0), (frozenset((0, 2)), 3.0), (frozenset((0, 3)), 5.0)}


def test_an_open_border_behind_them_meets_nothing() -> None:
    vertices = np.array([[0, 0, 0], [0, 2, 0], [0, 1, 0], [-1, 1, -1]], dtype=float)

    met = EdgeUses.of(Mesh(vertices, np.array([[1, 0, 3], [0, 1, 2]]))).meetings()

    assert not len(met.first)


def test_three_faces_around_them_have_no_angle() -> None:
    vertices = np.array([[0, 0, 0], [0, 2, 0], [0, 1, 0], [-1, 1, -1], [1, 1, -1]], dtype=float)
    extra = np.array([[1.0, 1.0, 1.0]])
    faces = np.array([[1, 0, 3], [0, 1, 2], [0, 2, 4], [2, 1, 4], [0, 2, 5], [2, 1, 5]])

    met = EdgeUses.of(Mesh(np.concatenate([vertices, extra]), faces)).meetings()

    assert not np.isin(0, [met.first, met.second])
