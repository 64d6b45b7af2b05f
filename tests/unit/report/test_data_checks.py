from __future__ import annotations

import numpy as np
import pytest

from meshcone.assets import read_asset
from meshcone.files import MeshFile
from meshcone.notices import Told, WarningRecord
from meshcone.options import Options, parse_options
from meshcone.quality.parts import Partition
from meshcone.quality.validity import inspect
from meshcone.report import data_checks
from meshcone.surface import Frame, Mesh
from meshcone.verbs.refine import refine
from tests import shapes

VERTICES, FACES = shapes.sphere(3, radius=1.0)
BALL = Mesh(VERTICES, FACES)
UPPER = FACES[VERTICES[FACES].mean(axis=1)[:, 2] > 0.0]
FRAME = Frame(np.zeros(3), 1.0)
FAST: Options = parse_options(
    {
        "effort": "fast",
        "solver": {"certify": False},
        "quality": {"samples": 500, "emd_samples": 50},
    }
)


def joined(first: Mesh, second: Mesh) -> Mesh:
    return Mesh(
        np.concatenate([first.vertices, second.vertices]),
        np.concatenate([first.faces, second.faces + len(first.vertices)]),
    )


def moved(mesh: Mesh, scale: float = 1.0, x: float = 0.0) -> Mesh:
    return mesh.moved_to(mesh.vertices * scale + [x, 0, 0])


def told(source: Mesh, reference: Mesh, pairs: int = 100_000) -> Told:
    found, reference_found = inspect(source, pairs), inspect(reference, pairs)
    return data_checks.data_warnings(
        source, reference, found, reference_found, FRAME, (whole(source), whole(reference))
    )


def data_warnings(source: Mesh, reference: Mesh) -> list[WarningRecord]:
    return told(source, reference).warnings


def whole(mesh: Mesh) -> Partition:
    return Partition(("",), np.zeros(len(mesh.faces), dtype=np.int64))


def words(source: Mesh, reference: Mesh) -> list[str]:
    return [warning.words for warning in data_warnings(source, reference)]


def with_faces(*faces: tuple[int, int, int]) -> Mesh:
    return Mesh(VERTICES, np.concatenate([FACES, np.array(faces)]))


HALF = Mesh(VERTICES, UPPER)
TURNED = Mesh(VERTICES, np.concatenate([FACES[:100, ::-1], FACES[100:]]))
INSIDE_OUT = Mesh(VERTICES, FACES[:, ::-1])
SATELLITE = joined(BALL, moved(BALL, 0.05, 0.5))
FIN = Mesh(
    np.concatenate([VERTICES, [[0.0, 0.0, 1.05]]]),
    np.concatenate([FACES, [[*FACES[0, :2], len(VERTICES)]]]),
)
CROSSED = joined(BALL, moved(BALL, 0.5, 0.7))
DOUBLED = with_faces(tuple(FACES[0]))
SLIVER = Mesh(  # the last vertex lies on an edge of its face
    np.concatenate([VERTICES, [VERTICES[FACES[0, :2]].mean(axis=0)]]),
    np.concatenate([FACES, [[FACES[0, 0], FACES[0, 1], len(VERTICES)]]]),
)

PAIRS = [
    pytest.param(BALL, HALF, "of the source's vertices are farther", id="reference with a hole"),
    pytest.param(HALF, BALL, "of the reference's surface is farther", id="source with a hole"),
    pytest.param(moved(BALL, 25.4), BALL, "25.4 times the size", id="larger unit"),
    pytest.param(moved(BALL, 0.001), BALL, "1/1000 of the size", id="smaller unit"),
    pytest.param(moved(BALL, x=30), BALL, "moved by (30, 0, 0)", id="elsewhere"),
    pytest.param(moved(HALF, x=30), BALL, "Along x the bounding boxes", id="part elsewhere"),
    pytest.param(INSIDE_OUT, BALL, "100 % of the source's normals oppose", id="inside out"),
    pytest.param(TURNED, BALL, "outsides in opposite directions", id="mixed orientation"),
    pytest.param(SATELLITE, BALL, "in 2 pieces and the reference in 1 piece", id="pieces"),
    pytest.param(FIN, BALL, "source has 1 edge where more than two faces", id="non-manifold"),
    pytest.param(BALL, FIN, "reference has 1 edge where more than two", id="in the reference"),
    pytest.param(DOUBLED, BALL, "source has 1 face with the same corners", id="duplicate face"),
    pytest.param(CROSSED, BALL, "of faces that pass through each other", id="self-intersections"),
    pytest.param(SLIVER, BALL, "source has 1 face without area", id="degenerate face"),
]


@pytest.mark.parametrize(("source", "reference", "said"), PAIRS)
def test_a_failure_of_the_data_is_named(source: Mesh, reference: Mesh, said: str) -> None:
    assert any(said in sentence for sentence in words(source, reference))


@pytest.mark.parametrize(("source", "reference", "said"), PAIRS)
def test_a_failure_of_the_data_leaves_finite_positions(
    source: Mesh, reference: Mesh, said: str
) -> None:
    refined = refine(file("source.obj", source), file("reference.obj", reference), FAST)

    assert said
    assert np.isfinite(read_asset(refined.name, refined.data).positions).all()
    assert "NaN" not in refined.report.model_dump_json()


@pytest.mark.parametrize(
    ("source", "reference", "code", "side"),
    [
        (BALL, HALF, "coverage.extra", "source"),
        (HALF, BALL, "coverage.missing", "reference"),
        (moved(BALL, x=30), BALL, "pose.moved", "pair"),
        (moved(HALF, x=30), BALL, "pose.apart", "pair"),
        (moved(HALF, 1000), BALL, "units.factor_1000", "pair"),
        (INSIDE_OUT, BALL, "normals.opposed", "pair"),
        (BALL, FIN, "edges.non_manifold", "reference"),
        (INSIDE_OUT, BALL, "surface.inside_out", "source"),
        (BALL, INSIDE_OUT, "surface.inside_out", "reference"),
        (DOUBLED, BALL, "faces.duplicate", "source"),
    ],
)
def test_a_warning_has_a_code_and_a_side(
    source: Mesh, reference: Mesh, code: str, side: str
) -> None:
    assert (code, side) in {(each.code, each.side) for each in data_warnings(source, reference)}


def test_an_isolated_vertex_is_named_and_refined_around() -> None:
    loose = Mesh(np.concatenate([VERTICES, [[9.0, 9.0, 9.0]]]), FACES)

    refined = refine(file("source.obj", loose), file("reference.obj", BALL), FAST)

    assert words(loose, BALL) == ["The source has 1 vertex that no face uses."]
    assert read_asset(refined.name, refined.data).positions[-1].tolist() == [9, 9, 9]


def test_a_good_pair_draws_no_warning() -> None:
    rough = BALL.moved_to(shapes.noisy(VERTICES, 0.02))

    assert data_warnings(rough, Mesh(*shapes.sphere(4, radius=1.0))) == []


def test_flat_meshes_are_compared_along_their_plane() -> None:
    square = Mesh(
        np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]]), np.array([[0, 1, 2], [0, 2, 3]])
    )

    assert data_warnings(square, square) == []


def test_a_plate_of_two_sides_is_not_inside_out() -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    plate = Mesh(corners / 3 + 0.1, np.array([[0, 1, 2], [0, 2, 3], [2, 1, 0], [3, 2, 0]]))

    assert "surface.inside_out" not in [each.code for each in data_warnings(plate, plate)]


@pytest.mark.parametrize(
    "broken",
    [
        Mesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64)),
        Mesh(VERTICES, np.zeros((0, 3), dtype=np.int64)),
        Mesh(np.zeros_like(VERTICES), FACES),
        Mesh(np.full_like(VERTICES, np.nan), FACES),
        Mesh(np.full_like(VERTICES, np.inf), FACES),
    ],
)
def test_a_mesh_without_a_surface_is_named_and_nothing_raised(broken: Mesh) -> None:
    assert words(broken, BALL) == ["The source holds no surface."]
    assert words(BALL, broken) == ["The reference holds no surface."]


def test_no_defect_is_lost_in_the_reference_frame() -> None:
    frame = Frame.of(moved(BALL, 1000))
    source = Mesh(frame.into(1000 * SLIVER.vertices), SLIVER.faces)

    assert any("without area" in sentence for sentence in words(source, BALL))


def file(name: str, mesh: Mesh) -> MeshFile:
    return MeshFile(name, shapes.obj(mesh.vertices, mesh.faces))


def test_what_was_not_looked_for_is_told() -> None:
    elsewhere = moved(BALL, scale=1.0, x=50.0)
    stretched = elsewhere.moved_to(elsewhere.vertices * [1, 2, 3] + elsewhere.vertices**2 / 99)
    fits = {"coverage.missing", "normals.opposed", "pieces.missing", "pieces.displaced"}

    assert told(BALL, BALL).not_examined == frozenset()
    assert told(BALL, BALL, pairs=1).not_examined == {"faces.crossing"}
    assert told(stretched, BALL).not_examined >= fits
    assert told(Mesh(VERTICES, FACES[:0]), BALL).not_examined >= {*fits, "faces.crossing"}


def test_normals_are_not_compared_where_most_of_the_source_has_nothing_near() -> None:
    wide = moved(BALL, scale=1.5)
    bent = wide.moved_to(wide.vertices + 0.5 * np.abs(wide.vertices[:, [1, 2, 0]]))

    assert "normals.opposed" in told(bent, BALL).not_examined


def test_parts_of_a_file_of_very_many_are_not_searched() -> None:
    corners = np.array([[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0]])
    places = np.array([(x, y, x * y) for x in range(40) for y in range(30)]) / 40
    vertices = (places[:, None] + corners).reshape(-1, 3)
    leaves = Mesh(vertices, np.arange(len(vertices)).reshape(-1, 3))

    expected = {"pieces.missing", "pieces.extra", "pieces.displaced"}
    assert told(leaves, leaves).not_examined == expected
