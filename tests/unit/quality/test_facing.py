"""Which way a mesh faces as a whole."""

from __future__ import annotations

import numpy as np
import pytest

from meshcone.quality.facing import orientation_of
from meshcone.surface import Mesh
from tests.meshes import sheet, sphere, torus


def turned(mesh: Mesh) -> Mesh:
    return Mesh(mesh.vertices, mesh.faces[:, ::-1])


@pytest.mark.parametrize("agreement", [-0.05, 0.05])
def test_where_normals_do_not_tell_the_enclosed_volumes_do(agreement: float) -> None:
    ball, ring = sphere(2), torus(12, 6)

    assert orientation_of(ball, ring, agreement) == 1
    assert orientation_of(turned(ball), ring, agreement) == -1
    assert orientation_of(turned(ball), turned(ring), agreement) == 1


@pytest.mark.parametrize("agreement", [-0.5, 0.5])
def test_where_normals_tell_they_decide(agreement: float) -> None:
    assert orientation_of(sphere(2), torus(12, 6), agreement) == np.sign(agreement)


@pytest.mark.parametrize("agreement", [-0.05, 0.05])
def test_a_sheet_encloses_nothing(agreement: float) -> None:
    assert orientation_of(sheet(5, 5), sphere(2), agreement) == np.sign(agreement)


def test_where_a_mesh_is_does_not_count() -> None:
    away = Mesh(sphere(2).vertices + 100, sphere(2).faces)

    assert orientation_of(away, sphere(2), -0.01) == 1
