from __future__ import annotations

import json
import struct

import numpy as np
import pytest

from meshcone.assets import Limits, read_asset
from meshcone.assets.policy import ReadPolicy
from meshcone.errors import InputError, LimitError
from meshcone.notices import Code, Notice
from tests.unit.assets.builders import Gltf, cube_gltf, flat_gltf, split_cube

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], dtype=np.float32)


def read(gltf: Gltf, limits: Limits | None = None):
    return read_asset("mesh.glb", gltf.glb(), limits=limits)


def refused(gltf: Gltf) -> InputError:
    with pytest.raises(InputError) as caught:
        read(gltf)
    return caught.value


def test_a_split_cube_is_welded():
    asset = read(cube_gltf())
    counts = asset.counts()
    assert (counts.vertices, counts.welded_vertices, counts.faces) == (24, 8, 12)
    assert (asset.format, asset.media_type) == ("glb", "model/gltf-binary")


def test_a_buffer_may_be_a_data_uri():
    asset = read_asset("mesh.gltf", cube_gltf().embedded())
    assert asset.counts().welded_vertices == 8
    assert (asset.format, asset.media_type) == ("gltf", "model/gltf+json")


@pytest.mark.parametrize("uri", ["Box%200.bin", "./Box%200.bin", "Box 0.bin"])
def test_a_buffer_may_be_a_file_sent_along(uri):
    gltf = cube_gltf()
    asset = read_asset("mesh.gltf", gltf.separate(uri), {"Box 0.bin": bytes(gltf.binary)})
    assert asset.counts().welded_vertices == 8


@pytest.mark.parametrize(
    ("uri", "message"),
    [
        ("Box0.bin", "'Box0.bin', which was not sent"),
        ("../secret/Box.bin", "not the name of a file sent along"),
        ("/etc/passwd", "not the name of a file sent along"),
        ("https://example.org/Box.bin", "not the name of a file sent along"),
        ("data:,ab", "declares .* bytes, the buffer has 2"),
        ("data:application/octet-stream;base64,!!", "not valid base64"),
        ("data:nothing", "has no comma"),
    ],
)
def test_a_buffer_that_is_not_there_is_refused(uri, message):
    with pytest.raises(InputError, match=message) as caught:
        read_asset("mesh.gltf", cube_gltf().separate(uri), {"Box.bin": b""})
    assert caught.value.place.startswith("/buffers/0")


def test_node_transforms_are_applied_from_the_root_down():
    gltf = Gltf()
    mesh = gltf.mesh({"attributes": {"POSITION": gltf.accessor(SQUARE[:3])}})
    child = gltf.node(root=False, mesh=mesh, scale=[2, 3, 4], translation=[1, 0, 0])
    gltf.node(children=[child], rotation=[0, 0, np.sqrt(0.5), np.sqrt(0.5)])
    assert read(gltf).vertices == pytest.approx(np.array([[0, 1, 0], [0, 3, 0], [-3, 1, 0]]))


def test_a_matrix_is_stored_by_columns():
    gltf = flat_gltf(SQUARE[:3])
    gltf.json["nodes"][0]["matrix"] = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1]
    assert read(gltf).vertices[0].tolist() == [5, 6, 7]


def test_a_mirroring_node_turns_the_winding():
    gltf = flat_gltf(SQUARE[:3])
    gltf.json["nodes"][0]["scale"] = [-1, 1, 1]
    asset = read(gltf)
    a, b, c = asset.vertices[asset.faces[0]]
    assert np.cross(b - a, c - a)[2] > 0


def test_strips_alternate_their_winding():
    asset = read(flat_gltf(SQUARE, mode=5))
    assert asset.faces.tolist() == [[0, 1, 2], [1, 3, 2]]


def test_fans_turn_around_their_first_vertex():
    asset = read(flat_gltf(SQUARE[[0, 1, 3, 2]], mode=6))
    assert asset.faces.tolist() == [[1, 2, 0], [2, 3, 0]]


def test_points_and_lines_are_passed_over():
    gltf = cube_gltf()
    gltf.json["meshes"][0]["primitives"].append({"attributes": {"POSITION": 0}, "mode": 1})
    assert read(gltf).counts().faces == 12


def test_interleaved_attributes_are_taken_apart():
    gltf = Gltf()
    rows = np.zeros(3, dtype=[("position", "<f4", 3), ("normal", "<f4", 3)])
    rows["position"], rows["normal"] = SQUARE[:3], [0, 0, 1]
    view = gltf.view(rows.tobytes(), stride=24)
    position = gltf.accessor(rows["position"], view)
    normal = gltf.accessor(rows["normal"], view, offset=12)
    gltf.node(mesh=gltf.mesh({"attributes": {"POSITION": position, "NORMAL": normal}}))
    assert read(gltf).vertices.tolist() == SQUARE[:3].tolist()


def test_sparse_elements_replace_the_dense_ones():
    gltf = flat_gltf(SQUARE[:3])
    gltf.json["accessors"][0]["sparse"] = {
        "count": 1,
        "indices": {"bufferView": gltf.view(b"\2\0"), "componentType": 5123},
        "values": {"bufferView": gltf.view(struct.pack("<3f", 0, 9, 0))},
    }
    assert read(gltf).vertices[2].tolist() == [0, 9, 0]


def test_quantized_positions_are_decoded():
    gltf = flat_gltf((SQUARE[:3] * 127).astype(np.int8))
    gltf.json["accessors"][0]["normalized"] = True
    gltf.json["extensionsRequired"] = gltf.json["extensionsUsed"] = ["KHR_mesh_quantization"]
    assert read(gltf).vertices.tolist() == SQUARE[:3].tolist()


def test_primitives_sharing_positions_share_their_raw_vertices():
    gltf = cube_gltf()
    primitive = gltf.json["meshes"][0]["primitives"][0]
    gltf.json["meshes"][0]["primitives"] = [primitive | {"material": n} for n in range(2)]
    counts = read(gltf).counts()
    assert (counts.vertices, counts.faces, counts.materials) == (24, 24, 2)


def test_an_instanced_mesh_can_be_read():
    gltf = cube_gltf()
    gltf.node(mesh=0, translation=[5, 0, 0])
    counts = read(gltf).counts()
    assert (counts.welded_vertices, counts.meshes) == (16, 2)


def posed(gltf: Gltf):
    """The file read as its skins are bound; its one primitive follows the first joint."""
    attributes = gltf.json["meshes"][0]["primitives"][0]["attributes"]
    weights = np.tile(np.array([[1, 0, 0, 0]], dtype=np.float32), (24, 1))
    attributes["JOINTS_0"] = gltf.accessor(np.zeros((24, 4), dtype=np.uint8))
    attributes["WEIGHTS_0"] = gltf.accessor(weights)
    gltf.json["skins"] = [{"joints": [0]}]
    return read_asset("mesh.glb", gltf.glb(), policy=ReadPolicy("bind"))


def test_a_skinned_mesh_can_be_read_in_its_bind_pose_with_a_warning():
    asset = posed(cube_gltf(translation=[5, 0, 0], skin=0))
    assert asset.vertices.min() == 0
    words = "mesh 'Cube' is skinned: read in its bind pose"
    assert asset.warnings == (Notice(Code.SKIN_BIND_POSE, words),)


def test_many_skinned_meshes_are_one_warning_with_their_number():
    gltf = cube_gltf(skin=0)
    for number in range(24):
        gltf.json["meshes"].append({**gltf.json["meshes"][0], "name": f"Copy {number}"})
        gltf.node(mesh=number + 1, skin=0)

    [found] = posed(gltf).warnings

    assert found.code == Code.SKIN_BIND_POSE
    assert found.words == ("25 meshes, mesh 'Cube' the first, are skinned: read in their bind pose")


def test_only_the_default_scene_is_read():
    gltf = cube_gltf()
    gltf.json["scenes"].append({"nodes": [gltf.node(root=False, mesh=0)]})
    assert read(gltf).counts().meshes == 1


def test_without_a_scene_all_root_nodes_are_read():
    gltf = cube_gltf()
    del gltf.json["scenes"], gltf.json["scene"]
    assert read(gltf).counts().meshes == 1


@pytest.mark.parametrize(
    ("path", "value", "place", "message"),
    [
        ("asset/version", "1.0", "/asset/version", "expected 2.0"),
        ("accessors/0/count", 25, "/accessors/0/count", "25 elements need 300 bytes"),
        (
            "accessors/0/count",
            "24",
            "/accessors/0/count",
            "expected a whole number, found a string",
        ),
        ("accessors/0/byteOffset", 4, "/accessors/0/count", "need 292 bytes"),
        ("accessors/0/componentType", 5130, "/accessors/0/componentType", "unknown component"),
        ("accessors/0/componentType", 5122, "/accessors/0/componentType", "must be FLOAT"),
        ("accessors/0/type", "VEC2", "/accessors/0/type", "must be VEC3"),
        ("accessors/0/bufferView", 99, "/accessors/0/bufferView", "names buffer view 99"),
        ("accessors/1/count", 23, "/accessors/1/count", "23 of NORMAL for 24 positions"),
        ("accessors/3/componentType", 5126, "/accessors/3/count", "need 144 bytes"),
        ("bufferViews/0/byteLength", 10**12, "/bufferViews/0/byteLength", "ends at byte"),
        ("bufferViews/0/byteStride", 4, "/bufferViews/0/byteStride", "4 bytes for elements of 12"),
        ("bufferViews/0/buffer", 7, "/bufferViews/0/buffer", "names buffer 7"),
        ("nodes/0/mesh", 1, "/nodes/0/mesh", "names mesh 1, but there are only 1"),
        ("nodes/0/mesh", -1, "/nodes/0/mesh", "at least 0"),
        ("nodes/0/children", [0], "/nodes/0", "reached twice"),
        ("nodes/0/rotation", [0, 0, 0, 0], "/nodes/0/rotation", "unit quaternion"),
        ("nodes/0/scale", [1, 1], "/nodes/0/scale", "3 finite numbers"),
        ("nodes/0/matrix", [1] * 16, "/nodes/0/matrix", "last row"),
        ("nodes/0/scale", [1e200] * 3, "/accessors/0", "not at finite coordinates"),
        ("meshes/0/primitives/0/mode", 7, "/meshes/0/primitives/0/mode", "unknown primitive mode"),
        ("meshes/0/primitives/0/attributes", [], None, "expected an object, found an array"),
        ("scene", 3, "/scene", "names scene 3"),
        ("nodes", [], "/scenes/0/nodes/0", "names node 0"),
        ("scenes/0/nodes", [], None, "it has no faces"),
    ],
)
def test_a_damaged_document_is_refused_with_its_place(path, value, place, message):
    gltf = cube_gltf()
    *parents, key = path.split("/")
    target = gltf.json
    for parent in parents:
        target = target[int(parent) if parent.isdigit() else parent]
    target[key] = value
    error = refused(gltf)
    assert place is None or error.place == place
    assert error.file == "mesh.glb"
    with pytest.raises(InputError, match=message):
        raise error


def test_harmless_required_extensions_are_accepted():
    gltf = cube_gltf()
    gltf.json["extensionsRequired"] = ["KHR_materials_unlit", "KHR_texture_transform"]
    assert read(gltf).counts().faces == 12


def test_an_index_out_of_range_is_refused():
    error = refused(flat_gltf(SQUARE[:3], np.array([0, 1, 3])))
    assert "names vertex 3 of only 3" in error.message


def test_a_file_whose_only_triangle_has_an_infinite_corner_is_refused():
    positions = SQUARE[:3].copy()
    positions[1, 0] = np.inf
    gltf = flat_gltf(positions)
    del gltf.json["accessors"][0]["max"]
    assert "it has no faces" in refused(gltf).message


def test_sparse_indices_must_ascend():
    gltf = flat_gltf(SQUARE[:3])
    gltf.json["accessors"][0]["sparse"] = {
        "count": 2,
        "indices": {"bufferView": gltf.view(b"\2\1"), "componentType": 5121},
        "values": {"bufferView": gltf.view(bytes(24))},
    }
    assert "must ascend" in refused(gltf).message


def test_a_declared_count_without_a_buffer_is_bounded():
    document = json.loads(flat_gltf(SQUARE[:3]).embedded())
    document["accessors"][0] = {"componentType": 5126, "type": "VEC3", "count": 3 * 10**8}
    with pytest.raises(LimitError):
        read_asset("mesh.gltf", json.dumps(document).encode())


def test_instances_count_against_the_limits():
    gltf = cube_gltf()
    for _ in range(9):
        gltf.node(mesh=0)
    with pytest.raises(LimitError, match="vertices in the scene"):
        read(gltf, Limits(vertices=100))


def test_primitives_that_share_indices_count_each():
    gltf = cube_gltf()
    gltf.json["meshes"][0]["primitives"] *= 10
    with pytest.raises(LimitError, match="triangles"):
        read(gltf, Limits(faces=100))


def test_a_deep_node_tree_is_refused():
    gltf = cube_gltf()
    for child in range(10):
        gltf.node(root=False, children=[child])
    gltf.json["scenes"][0]["nodes"] = [10]
    with pytest.raises(LimitError, match="levels of nodes"):
        read(gltf, Limits(node_depth=5))


def test_vertices_equal_in_a_node_stay_equal_in_the_world():
    gltf = cube_gltf(rotation=[0.1, 0.2, 0.3, np.sqrt(0.86)], scale=[0.1, 0.7, 1.3])
    assert read(gltf).counts().welded_vertices == len(np.unique(split_cube()[0], axis=0))
