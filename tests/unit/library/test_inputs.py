"""What may be given as a mesh, and what is said of anything else."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

import meshcone
from meshcone.errors import ArgumentError, InputError
from meshcone.files import MeshFile
from tests import shapes
from tests.unit.library.meshes import FACES, ROUGH, rough

OBJ = shapes.obj(ROUGH, FACES)
NAN = np.where(np.arange(len(ROUGH))[:, None] == 3, np.nan, ROUGH)
COUNT = len(ROUGH)


def test_a_path_is_read_with_the_buffers_beside_it(tmp_path: Path) -> None:
    document, buffer = shapes.gltf(ROUGH, FACES, "ball.bin")
    (tmp_path / "ball.gltf").write_bytes(document)
    (tmp_path / "ball.bin").write_bytes(buffer)

    mesh = meshcone.load(str(tmp_path / "ball.gltf"))

    assert mesh.name == "ball.gltf"
    assert mesh.resources == {"ball.bin": buffer}
    assert mesh.mesh.vertices.shape == (COUNT, 3)


def test_bytes_come_with_a_name() -> None:
    mesh = meshcone.load(("ball.obj", OBJ))

    assert (mesh.name, mesh.data) == ("ball.obj", OBJ)


def test_a_name_of_the_callers_takes_the_place_of_its_own() -> None:
    assert meshcone.load(("ball.obj", OBJ), name="scan.obj").name == "scan.obj"


def test_arrays_keep_every_digit_and_their_order() -> None:
    mesh = meshcone.load((ROUGH, FACES)).mesh

    assert mesh.vertices.tobytes() == ROUGH.tobytes()
    assert mesh.faces.tobytes() == FACES.tobytes()


def test_a_mesh_that_was_loaded_stays_what_it_was_when_the_original_changes() -> None:
    given, vertices = rough(), ROUGH.copy()
    loaded = [meshcone.load(given), meshcone.load((vertices, FACES))]

    given.vertices += 1
    vertices += 1

    assert [each.mesh.vertices.tobytes() for each in loaded] == [ROUGH.tobytes()] * 2


def test_faces_with_four_corners_stay_polygons() -> None:
    square = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]

    mesh = meshcone.load((square, [[0, 1, 2, 3]]))

    assert mesh.data.endswith(b"\nf 1 2 3 4\n")
    assert mesh.mesh.faces.shape == (2, 3)


def test_a_concave_face_of_arrays_is_split_as_the_engine_splits_it() -> None:
    dart = [[0, 0, 0], [2, 1, 0], [0, 2, 0], [1, 1, 0]]

    assert meshcone.load((dart, [[0, 1, 2, 3]])).mesh.area == pytest.approx(1)


def test_a_scene_keeps_its_geometries() -> None:
    box = trimesh.creation.box()
    box.apply_translation([5, 0, 0])

    mesh = meshcone.load(trimesh.Scene({"ball": rough(), "box": box}))

    assert set(mesh.scene.geometry) == {"ball", "box"}
    assert len(mesh.mesh.faces) == len(FACES) + 12


def test_colours_are_kept() -> None:
    mesh = rough()
    mesh.visual.vertex_colors = np.tile([255, 0, 0, 255], (COUNT, 1))

    loaded = meshcone.load(mesh)

    assert loaded.name == "mesh.glb"
    [geometry] = loaded.scene.geometry.values()
    assert geometry.visual.kind == "vertex"


def test_colours_far_from_the_origin_are_refused_for_single_precision_would_tear_the_mesh() -> None:
    mesh = rough()
    mesh.visual.vertex_colors = np.tile([255, 0, 0, 255], (COUNT, 1))
    mesh.vertices += [1e6, 0, 0]

    with pytest.raises(InputError, match="move the mesh to the origin, or leave out its materials"):
        meshcone.load(mesh)


def test_a_primitive_is_a_mesh_like_others() -> None:
    mesh = meshcone.load(trimesh.primitives.Box()).mesh

    mesh.vertices += 1
    assert mesh.area == 6


DART = b"v 0 0 0\nv 2 1 0\nv 0 2 0\nv 1 1 0\nf 1 2 3 4\n"
STRIP = (
    b"ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
    b"property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
    b"element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
    b"0 0 0 255 0 0\n1 0 0 0 255 0\n0 1 0 0 0 255\n1 1 0 9 9 9\n4 0 1 2 3\n"
)


@pytest.mark.parametrize(
    ("name", "data", "faces", "area"),
    [
        ("concave.obj", DART, 2, 1),
        ("tabs.obj", DART.replace(b" ", b"\t"), 2, 1),
        ("mark.obj", b"\xef\xbb\xbf" + DART, 2, 1),
        ("returns.obj", DART.replace(b"\n", b"\r"), 2, 1),
        ("strip.ply", STRIP, 2, 1),
        ("concave.off", b"OFF\n4 1 0\n0 0 0\n2 1 0\n0 2 0\n1 1 0\n4 0 1 2 3\n", 2, 1),
    ],
)
def test_the_mesh_has_the_triangles_that_the_engine_has(
    name: str, data: bytes, faces: int, area: float
) -> None:
    mesh = meshcone.load((name, data)).mesh

    assert len(mesh.faces) == faces
    assert mesh.area == pytest.approx(area)


def test_materials_and_texture_coordinates_stay_where_triangles_are_the_engines() -> None:
    painted = b"mtllib a.mtl\nusemtl wood\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n" + DART
    painted = painted.replace(b"f 1 2 3 4", b"f 1/1 2/2 3/3 4/4")
    library = b"newmtl wood\nKd 1 0 0\n"

    mesh = meshcone.load(MeshFile("a.obj", painted, {"a.mtl": library})).mesh

    assert mesh.area == pytest.approx(1)
    assert mesh.visual.uv.tolist() == [[0, 0], [1, 0], [1, 1], [0, 1]]
    assert mesh.visual.material.diffuse.tolist() == [255, 0, 0, 255]


def test_colours_of_vertices_stay_where_triangles_are_the_engines() -> None:
    mesh = meshcone.load(("strip.ply", STRIP)).mesh

    assert mesh.visual.vertex_colors[:, :3].tolist() == [
        *([255, 0, 0], [0, 255, 0], [0, 0, 255], [9, 9, 9]),
    ]


@pytest.mark.parametrize("separator", [b" ", b","])
def test_points_without_faces_are_a_cloud_of_the_scene_and_no_mesh(separator: bytes) -> None:
    points = b"0 0 0\n1 0 0\n0 1 0\n0 0 1\n".replace(b" ", separator)
    loaded = meshcone.load(("scan.xyz", points))

    [cloud] = loaded.scene.geometry.values()
    assert np.allclose(cloud.vertices, [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    with pytest.raises(InputError, match="points and no faces: `scene` has them"):
        _ = loaded.mesh


def test_its_repr_is_short() -> None:
    assert repr(meshcone.load(("ball.obj", OBJ))) == f"<LoadedMesh ball.obj: {len(OBJ):,} bytes>"


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (3, "found a value of type int"),
        (None, "found a value of type NoneType"),
        ([1, 2, 3], "found a list of 3: int, int, int"),
        (ROUGH, f"found one ndarray of shape ({COUNT}, 3)"),
        (rough().vertices, f"found one TrackedArray of shape ({COUNT}, 3)"),
        (("a", "b"), "found a tuple of 2: str, str"),
        (OBJ, 'bytes need a file name, which tells their format: give ("mesh.glb", data)'),
        (trimesh.PointCloud(ROUGH), "found a trimesh PointCloud"),
    ],
)
def test_what_is_no_mesh_is_a_type_error_that_says_what_is(given: Any, said: str) -> None:
    with pytest.raises(ArgumentError) as error:
        meshcone.refine(given, rough())

    assert isinstance(error.value, TypeError)
    assert isinstance(error.value, InputError)
    assert str(error.value).startswith("source: ")
    assert said in str(error.value)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ((ROUGH[:, :2], FACES), f"the vertices must have the shape (n, 3), found ({COUNT}, 2)"),
        ((["x"], FACES), "the vertices are not an (n, 3) array of numbers"),
        (([], []), "the mesh has no vertices"),
        ((NAN, FACES), "vertex 3: (nan, nan, nan) is not finite"),
        ((ROUGH, []), "the mesh has no faces"),
        ((ROUGH, FACES[:, :2]), f"must have the shape (m, 3) or (m, 4), found ({len(FACES)}, 2)"),
        ((ROUGH, FACES * 1.0), "the faces must be integers, found float64"),
        ((ROUGH, [[0, 1], [1, 2, 3]]), "all must have the same number of corners"),
        ((ROUGH, [[0, 1, COUNT]]), f"face 0: the corners (0, 1, {COUNT}) are not all among"),
        ((ROUGH, [[0, 1, -1]]), "face 0: the corners (0, 1, -1) are not all among"),
        (trimesh.Trimesh(), "the mesh has no vertices"),
        (trimesh.Scene(), "the scene has no meshes"),
        ("absent.obj", "absent.obj: cannot be read: no such file or directory"),
        (("a.glb", b"xx"), "a.glb, byte 0: the file does not start with 'glTF'"),
    ],
)
def test_a_mesh_that_cannot_be_used_is_an_input_error_that_says_why(given: Any, said: str) -> None:
    with pytest.raises(InputError) as error:
        meshcone.load(given)

    assert said in str(error.value)


def test_a_mesh_knows_its_files_from_another_directory_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path)
    Path("ball.obj").write_bytes(OBJ)
    Path("pins.txt").write_text("0\n")
    loaded = meshcone.load("ball.obj")
    monkeypatch.chdir("elsewhere")

    assert loaded.files() == [tmp_path / "ball.obj"]
    assert loaded.with_file("pins.txt").files() == [tmp_path / "ball.obj", tmp_path / "pins.txt"]
    assert loaded.path == Path("ball.obj")


def colored_faces() -> trimesh.Trimesh:
    mesh = rough()
    mesh.visual.face_colors = np.arange(4 * len(FACES)).reshape(-1, 4) % 256
    return mesh


def test_colours_of_faces_are_not_blended_into_those_of_vertices() -> None:
    for given in (colored_faces(), trimesh.Scene(colored_faces())):
        with pytest.raises(InputError, match=r"they would blend: call \.unmerge_vertices\(\)"):
            meshcone.load(given)


def test_colours_of_faces_that_share_no_vertex_are_kept() -> None:
    apart, even = colored_faces(), rough()
    apart.unmerge_vertices()
    even.visual.face_colors = [200, 37, 5, 255]

    for given in (apart, even):
        read = trimesh.load_mesh(
            trimesh.util.wrap_as_stream(meshcone.load(given).data), file_type="glb", process=False
        )
        assert (read.visual.vertex_colors[read.faces] == given.visual.face_colors[:, None]).all()


def masked(values: Any) -> Any:
    return np.ma.masked_array(values, mask=np.arange(values.size).reshape(values.shape) == 4)


@pytest.mark.parametrize(
    ("vertices", "faces", "said"),
    [
        (masked(ROUGH), FACES, "some of the vertices are masked"),
        (ROUGH, masked(FACES), "some of the faces are masked"),
        (ROUGH + 1j, FACES, "the vertices are not an .* array of numbers"),
        (ROUGH.astype(str), FACES, "the vertices are not an .* array of numbers"),
        ([[0, 0, 10**400], *ROUGH[1:]], FACES, "numbers that double precision can hold"),
    ],
)
def test_arrays_that_would_lose_something_are_refused(vertices: Any, faces: Any, said: str) -> None:
    with pytest.raises(InputError, match=said):
        meshcone.load((vertices, faces))


def test_a_masked_array_in_which_nothing_is_masked_is_an_array() -> None:
    loaded = meshcone.load((np.ma.masked_array(ROUGH), FACES))

    assert loaded.mesh.vertices.tobytes() == ROUGH.tobytes()


def test_meshes_can_be_members_of_a_set() -> None:
    assert len({meshcone.load((ROUGH, FACES)), meshcone.load((ROUGH, FACES))}) == 1
