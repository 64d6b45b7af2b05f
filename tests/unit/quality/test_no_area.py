"""Faces whose height is the rounding of their file's numbers."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from meshcone.assets import read_asset
from meshcone.quality.no_area import without_area
from meshcone.surface import Mesh
from meshcone.surface.arrays import Floats
from tests.meshes import sphere

# A face that closes the gap between an edge and its two halves.
NEEDLE = [[0, 1, 2], [0, 1, 3]]
TURN = trimesh.transformations.euler_matrix(0.4, 0.7, 0.2)[:3, :3]
TURNED: Floats = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.5, 0, 0]]) @ TURN.T + 0.3


def obj(vertices: Floats, form: str, faces: list[list[int]]) -> bytes:
    lines = [" ".join(["v", *(form % number for number in row)]) for row in vertices]
    lines += [" ".join(["f", *(str(corner + 1) for corner in face)]) for face in faces]
    return "\n".join(lines).encode()


def binary(kind: str, vertices: Floats, faces: list[list[int]]) -> bytes:
    mesh = trimesh.Trimesh(vertices, faces, process=False, validate=False)
    return bytes(mesh.export(file_type=kind))


def counted(name: str, data: bytes) -> int:
    asset = read_asset(name, data)
    mesh = Mesh(asset.vertices, asset.faces, precision=asset.precision)
    return int(np.count_nonzero(without_area(mesh)))


@pytest.mark.parametrize("kind", ["glb", "stl", "ply"])
def test_a_vertex_rounded_off_its_edge_makes_a_face_without_area(kind: str) -> None:
    assert counted(f"mesh.{kind}", binary(kind, TURNED, NEEDLE)) == 1


@pytest.mark.parametrize("form", ["%.3f", "%.6f", "%g", "%.9g", "%.17g"])
def test_the_digits_of_a_text_tell_what_rounding_is(form: str) -> None:
    assert counted("mesh.obj", obj(1000 * TURNED, form, NEEDLE)) == 1


def test_a_needle_thicker_than_the_rounding_has_an_area() -> None:
    aside = TURNED.copy()
    aside[3] += 1e-5 * (TURNED[2] - TURNED[0])
    assert counted("mesh.glb", binary("glb", aside, NEEDLE)) == 0
    assert counted("mesh.obj", obj(aside, "%.6f", NEEDLE)) == 0


def test_a_plate_as_thick_as_one_step_of_its_file_has_sides() -> None:
    plate = trimesh.creation.box((1, 1, 0.001))
    assert counted("mesh.obj", obj(plate.vertices, "%.3f", plate.faces.tolist())) == 0


def test_a_small_face_of_a_precise_file_has_an_area() -> None:
    small = np.concatenate([np.eye(3), 1e-8 * np.eye(3)])
    assert counted("mesh.obj", obj(small, "%.17g", [[0, 1, 2], [3, 4, 5]])) == 0


def test_faces_as_small_as_the_steps_of_their_file_keep_their_shape() -> None:
    ball = sphere(3)
    assert counted("mesh.glb", binary("glb", ball.vertices + 3e4, ball.faces.tolist())) == 0


def test_the_frame_does_not_change_what_is_counted() -> None:
    asset = read_asset("mesh.obj", obj(1000 * TURNED, "%.3f", NEEDLE))
    mesh = Mesh(asset.vertices, asset.faces, precision=asset.precision)
    shrunk = mesh.moved_to(mesh.vertices / 1000 - 5, 1 / 1000)
    np.testing.assert_array_equal(without_area(shrunk), without_area(mesh))
