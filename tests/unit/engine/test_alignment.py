"""Refining a source that does not lie where its reference does."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from meshcone.assets import read_asset
from meshcone.errors import InputError
from meshcone.files import MeshFile
from meshcone.options import Options, parse_options
from meshcone.pair import read_pair
from meshcone.quality.deviation.interval import Asked, directed_deviation
from meshcone.surface import Mesh
from meshcone.surface.alignment import Alignment
from meshcone.surface.arrays import Floats
from meshcone.surface.similarity import similarity
from meshcone.verbs.measure import measure
from meshcone.verbs.refine import Refinement, refine
from meshcone.verbs.verify import read_report, verify
from tests.meshes import noisy, torus


def lopsided(rings: int, sides: int) -> Mesh:
    """A torus without symmetries."""
    mesh = torus(rings, sides)
    x, y, z = mesh.vertices.T
    return mesh.moved_to(np.stack([x * (1 + 0.3 * y), y + 0.2 * x**2, z * (1 + 0.4 * x)], axis=1))


def obj(mesh: Mesh) -> bytes:
    lines = [f"v {x:.12g} {y:.12g} {z:.12g}" for x, y, z in mesh.vertices]
    lines += ["f {} {} {}".format(*(face + 1)) for face in mesh.faces]
    return ("\n".join(lines) + "\n").encode()


TURN = Rotation.from_euler("xyz", [20, -35, 50], degrees=True).as_matrix()


@pytest.fixture(scope="module")
def source() -> MeshFile:
    scanned = noisy(lopsided(40, 20), 0.02)
    return MeshFile("scan.obj", obj(scanned.moved_to(25.4 * scanned.vertices @ TURN.T + 100)))


@pytest.fixture(scope="module")
def reference() -> MeshFile:
    return MeshFile("cad.obj", obj(lopsided(53, 26)))


@pytest.fixture(scope="module")
def refinement(source: MeshFile, reference: MeshFile) -> Refinement:
    return refine(source, reference, parse_options({"effort": "fast", "align": "similarity"}))


def test_a_scan_in_other_units_and_another_place_is_refined(refinement: Refinement):
    report = refinement.report

    assert report.outcome == "improved"
    assert report.alignment is not None
    assert report.alignment.method == "icp"
    refined = report.quality.refined
    assert refined is not None
    assert refined.point_to_surface.mean < 0.3 * report.quality.input.point_to_surface.mean


def test_the_refined_file_stays_where_the_source_was(source: MeshFile, refinement: Refinement):
    before = read_asset(source.name, source.data).vertices
    after = read_asset(refinement.name, refinement.data).vertices

    moved = np.linalg.norm(after - before, axis=1)
    assert np.median(moved) < 0.05 * 25.4
    np.testing.assert_allclose(after.mean(axis=0), before.mean(axis=0), atol=0.02 * 25.4)


def test_the_reported_matrix_brings_the_refined_file_to_the_reference(
    reference: MeshFile, refinement: Refinement
):
    assert refinement.report.alignment is not None
    matrix = np.array(refinement.report.alignment.matrix)
    refined = read_asset(refinement.name, refinement.data)
    moved = refined.vertices @ matrix[:3, :3].T + matrix[:3, 3]
    placed = MeshFile("placed.obj", obj(Mesh(moved, refined.faces)))

    found = measure(placed, reference, parse_options({}))

    stated = refinement.report.quality.refined
    assert stated is not None
    assert found.quality.input.point_to_surface.mean == pytest.approx(
        stated.point_to_surface.mean, rel=1e-3
    )


def test_an_aligned_refinement_verifies(
    source: MeshFile, reference: MeshFile, refinement: Refinement
):
    assert refinement.certificate is not None
    report = read_report(refinement.report.model_dump_json().encode(), "report.json")
    certificate = MeshFile("certificate.npz", refinement.certificate)

    found = verify(
        report, certificate, source, reference, MeshFile(refinement.name, refinement.data)
    )

    assert found.ok, found.checks


def test_an_unknown_alignment_is_refused_by_name():
    with pytest.raises(InputError, match="align"):
        parse_options({"align": "affine"})


def test_boxes_of_one_generator_are_turned_though_their_faces_are_equal() -> None:
    def box(*sides: float) -> MeshFile:
        made = trimesh.creation.box(extents=sides)
        return MeshFile("box.obj", obj(Mesh(made.vertices, made.faces)))

    answer = refine(box(3, 1, 2), box(1, 2, 3), parse_options({"align": "rigid"}))

    assert answer.report.alignment is not None
    assert answer.report.alignment.after < 1e-6
    assert answer.report.outcome == "indistinguishable"


def test_the_interval_of_a_source_aligned_from_far_away_includes_what_the_motion_rounds() -> None:
    square = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    over = np.array([[-0.3, -0.2, 0.125], [0.4, -0.1, 0.125], [0.0, 0.5, 0.125]])
    far = np.array([500000.3, 4600000.7, 100.1])
    rotation = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
    rotation *= np.sign(np.linalg.det(rotation))
    matrix = similarity(rotation, 1.0, far, np.zeros(3))
    source, reference = (
        MeshFile(name, as_written(vertices, faces))
        for name, vertices, faces in (
            ("s.obj", over @ rotation + far, [[0, 1, 2]]),
            ("r.obj", square, [[0, 1, 2], [0, 2, 3]]),
        )
    )

    pair = read_pair(source, reference, Options(align="rigid"))
    placed = pair.placed(Alignment(matrix, "icp", 0.0, 0.0))

    found = directed_deviation(placed.source, placed.reference, Asked(1e-12, 1e-12, 1000))
    highest = max(height(matrix, vertex) for vertex in pair.source_asset.vertices)
    assert found.upper * pair.frame.radius < highest  # by what the motion rounds
    assert (found.upper + placed.tolerance) * pair.frame.radius >= highest
    assert pair.tolerance == 0.0


def height(matrix: Floats, vertex: Floats) -> Fraction:
    x, y, z, moved = (Fraction(float(entry)) for entry in matrix[2])
    here = [Fraction(float(value)) for value in vertex]
    return abs(x * here[0] + y * here[1] + z * here[2] + moved)


def as_written(vertices: Floats, faces: list[list[int]]) -> bytes:
    lines = ["v {!r} {!r} {!r}".format(*map(float, vertex)) for vertex in vertices]
    lines += ["f {} {} {}".format(*(corner + 1 for corner in face)) for face in faces]
    return "\n".join(lines).encode()
