"""Staying on one side of a closed reference."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import meshcone
from meshcone.errors import InputError
from meshcone.options import ConeOptions, parse_options
from meshcone.program.staying import Staying
from meshcone.surface import Mesh, SurfaceTree
from tests.meshes import noisy, sheet, sphere

# No facet of the reference is nearer to the origin.
INRADIUS = float(np.einsum("ij,ij->i", sphere(3).face_normals, sphere(3).corners[:, 0]).min())
QUICK: dict[str, Any] = {
    "effort": "fast",
    "audit": False,
    "quality": {"samples": 500, "emd_samples": 16, "curvature_samples": 16},
}


def refined(source: Mesh, **cones: Any) -> Mesh:
    reference = sphere(3)
    given = (source.vertices, source.faces), (reference.vertices, reference.faces)
    found = meshcone.refine(*given, cones=cones, **QUICK)
    assert found.report.certificate is not None
    assert found.report.certificate.holds
    return Mesh(np.asarray(found.mesh.vertices), np.asarray(found.mesh.faces))


def radii(mesh: Mesh) -> dict[str, np.ndarray]:
    points = {
        "vertices": mesh.vertices,
        "edges": mesh.vertices[mesh.edges].mean(axis=1),
        "faces": mesh.corners.mean(axis=1),
    }
    return {name: np.linalg.norm(found, axis=1) for name, found in points.items()}


@pytest.mark.parametrize("offset", [0.0, 0.05])
def test_what_stays_outside_of_a_ball_has_no_vertex_edge_or_face_in_it(offset: float) -> None:
    away = {"offset": {"relative": offset}} if offset else {}
    found = radii(refined(noisy(sphere(2), 0.03, seed=3), stay="outside", **away))

    assert min(each.min() for each in found.values()) >= INRADIUS + offset - 1e-4


@pytest.mark.parametrize("offset", [0.0, 0.05])
def test_what_stays_inside_of_a_ball_does_not_reach_out_of_it(offset: float) -> None:
    away = {"offset": {"relative": offset}} if offset else {}
    found = radii(refined(noisy(sphere(2), 0.03, seed=3), stay="inside", **away))

    assert max(each.max() for each in found.values()) <= 1 - offset + 0.015


def test_a_cage_is_proven_to_be_outside_alone() -> None:
    source, reference = noisy(sphere(2), 0.03, seed=3), sphere(3)
    given = (source.vertices, source.faces), (reference.vertices, reference.faces)

    away = {"stay": "outside", "offset": {"relative": 0.05}}
    found = meshcone.refine(*given, cones=away, **QUICK)

    assert found.report.deviation is not None
    assert found.report.deviation.inside is not None
    assert found.report.deviation.inside.upper == 0
    assert meshcone.verify(found).ok


def test_points_have_no_side() -> None:
    points = Mesh(np.eye(3), np.array([[0, 0, 0], [1, 1, 1], [2, 2, 2]]), is_points=True)

    with pytest.raises(InputError, match="points and no faces"):
        Staying.of(SurfaceTree(points), ConeOptions.model_validate({"stay": "outside"}), 1.0)


def test_without_a_side_the_same_mesh_goes_through_the_ball() -> None:
    found = radii(refined(noisy(sphere(2), 0.03, seed=3)))

    assert found["vertices"].max() > 1.001
    assert found["faces"].min() < INRADIUS - 0.003


def signs(reference: Mesh, side: str = "outside") -> np.ndarray:
    found = Staying.of(SurfaceTree(reference), ConeOptions.model_validate({"stay": side}), 1.0)
    assert found is not None
    return found.signs


def turned(mesh: Mesh) -> Mesh:
    return Mesh(mesh.vertices, mesh.faces[:, ::-1])


def together(one: Mesh, other: Mesh) -> Mesh:
    vertices = np.concatenate([one.vertices, other.vertices])
    return Mesh(vertices, np.concatenate([one.faces, other.faces + len(one.vertices)]))


def test_the_side_does_not_depend_on_how_the_reference_is_turned() -> None:
    assert set(signs(sphere(1))) == {1.0}
    assert set(signs(turned(sphere(1)))) == {-1.0}
    assert set(signs(sphere(1), "inside")) == {-1.0}


def test_a_cavity_is_outside() -> None:
    cavity = turned(Mesh(0.5 * sphere(1).vertices, sphere(1).faces))

    assert set(signs(together(sphere(1), cavity))) == {1.0}


def test_a_piece_within_another_has_no_side() -> None:
    within = Mesh(0.5 * sphere(1).vertices, sphere(1).faces)
    found = signs(together(sphere(1), within))

    assert set(found[:80]) == {1.0}
    assert set(found[80:]) == {0.0}


def test_a_reference_without_an_inside_is_refused_in_words() -> None:
    flat = sheet(3, 3)
    given = (flat.vertices, flat.faces)

    with pytest.raises(InputError, match=r"to stay inside takes a closed reference.*8 edges"):
        meshcone.refine(given, given, cones={"stay": "inside"}, **QUICK)


def test_an_offset_needs_a_side() -> None:
    with pytest.raises(InputError, match="'offset' needs 'stay'"):
        parse_options({"cones": {"offset": {"model": 1.0}}})


def test_vertices_that_are_fixed_may_be_on_the_other_side() -> None:
    mesh = sphere(1)
    held = Staying.of(SurfaceTree(mesh), ConeOptions.model_validate({"stay": "outside"}), 1.0)
    assert held is not None
    everything = np.ones(len(mesh.vertices), dtype=bool)

    assert [len(family) for family in held.families(mesh, everything)] == [0, 0, 0]
