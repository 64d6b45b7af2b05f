"""Diagonals swapped towards the reference, inside the faces of the source."""

from __future__ import annotations

import numpy as np

from meshcone.detail.divided_mesh import DividedMesh
from meshcone.detail.flips import flip_inside
from meshcone.surface import Mesh, SurfaceTree

# A triangle with a point on each of two sides; they and the ends of the third are a
# quadrilateral, folded along the diagonal that the reference has.
CORNERS = np.array([[0.0, 0, 0], [4, 0, 0], [2, 4, 0]])
ONE = DividedMesh.of(Mesh(CORNERS, np.array([[0, 1, 2]])))


def folded(height: float) -> DividedMesh:
    """The quadrilateral's diagonal from corner 0 bent upwards in the middle of its other end."""
    split = ONE.split(np.array([False, True, True]))
    vertices = split.mesh.vertices.copy()
    vertices[3:, 2] = [height, 0.0]
    return split.moved_to(vertices)


def reference_of(divided: DividedMesh, swapped: bool) -> SurfaceTree:
    """The surface itself, or the one with the other diagonal."""
    faces = divided.mesh.faces.copy()
    pair = [row for row, face in enumerate(faces) if 2 not in face]
    if swapped:
        ends = set(faces[pair[0]]) & set(faces[pair[1]])
        c, d = (set(faces[row]) - ends for row in pair)
        a, b = (int(end) for end in _in_order(faces[pair[0]], ends))
        c_vertex, d_vertex = int(c.pop()), int(d.pop())
        faces[pair[0]], faces[pair[1]] = (a, d_vertex, c_vertex), (d_vertex, b, c_vertex)
    return SurfaceTree(Mesh(divided.mesh.vertices, faces))


def _in_order(face: np.ndarray, ends: set) -> tuple:
    for k in range(3):
        if {face[k], face[(k + 1) % 3]} == ends:
            return face[k], face[(k + 1) % 3]
    raise AssertionError


def edges(divided: DividedMesh) -> set[tuple[int, int]]:
    return {tuple(edge) for edge in divided.mesh.edges.tolist()}


def test_a_diagonal_is_swapped_where_the_other_is_on_the_reference() -> None:
    divided = folded(0.5)
    found = flip_inside(divided, reference_of(divided, swapped=True))
    assert edges(found) != edges(divided)
    assert found.subdivision().is_tiling()
    places = found.corners / 2**found.exponent
    flat = np.einsum("fki,ij->fkj", places, CORNERS)
    assert np.allclose(flat[..., :2], found.mesh.corners[..., :2])


def test_a_diagonal_on_the_reference_stays() -> None:
    divided = folded(0.5)
    assert flip_inside(divided, reference_of(divided, swapped=False)) is divided


def test_a_swap_that_gains_nothing_is_left_out() -> None:
    divided = folded(0.0)
    assert flip_inside(divided, reference_of(divided, swapped=True)) is divided


def test_no_diagonal_is_swapped_across_faces_of_the_source() -> None:
    vertices = np.array([[0.0, 0, 0], [1, 0, 0.2], [1, 1, 0], [0, 1, 0.2]])
    square = DividedMesh.of(Mesh(vertices, np.array([[0, 1, 2], [0, 2, 3]])))
    other = SurfaceTree(Mesh(vertices, np.array([[0, 1, 3], [1, 2, 3]])))
    assert flip_inside(square, other) is square
