from __future__ import annotations

import json
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from meshcone.assets import WritePolicy, read_asset
from tests.unit.assets.builders import Gltf, chunks, cube_gltf, flat_gltf

moves = arrays(np.float64, (8, 3), elements=st.floats(-3, 3, width=32))
KEEP = WritePolicy(normals="keep")
TRIANGLE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], dtype=np.float32)
TURNED = {"rotation": [0.5, 0.5, 0.5, 0.5], "scale": [2, 3, 0.5], "translation": [1, 2, 3]}


def read(data: bytes):
    return read_asset("mesh.glb", data)


def floats(glb: bytes, accessor: int, columns: int) -> np.ndarray:
    document, binary = chunks(glb)
    declared = document["accessors"][accessor]
    start = document["bufferViews"][declared["bufferView"]]["byteOffset"]
    count = declared["count"] * columns
    return np.frombuffer(binary, "<f4", count, start).reshape(-1, columns)


def test_nothing_moved_gives_the_same_bytes():
    for data in (cube_gltf(**TURNED).glb(), cube_gltf(**TURNED).embedded()):
        asset = read(data)
        assert asset.patched(asset.vertices.copy()) == data


@given(moves)
def test_vertices_come_back_where_they_were_put(move):
    asset = read(cube_gltf(**TURNED).glb())
    again = read(asset.patched(asset.vertices + move))
    expected = (asset.vertices + move)[asset.weld]
    assert again.positions == pytest.approx(expected, abs=2e-6)


@given(moves)
def test_seams_texture_coordinates_and_indices_stay(move):
    before = cube_gltf(**TURNED).glb()
    asset = read(before)
    after = asset.patched(asset.vertices + move)
    assert chunks(after)[1][24 * 24 :] == chunks(before)[1][24 * 24 :]
    again = read(after).positions
    for vertex in range(8):
        assert len(np.unique(again[asset.weld == vertex], axis=0)) == 1


def test_a_vertex_that_stays_keeps_its_bytes():
    before = cube_gltf().glb()
    asset = read(before)
    moved = asset.vertices.copy()
    moved[2] += 0.25
    after = floats(asset.patched(moved), 0, 3)
    changed = (after != floats(before, 0, 3)).any(axis=1)
    assert changed.tolist() == (asset.weld == 2).tolist()


def test_bounds_follow_the_vertices():
    asset = read(cube_gltf().glb())
    document, _ = chunks(asset.patched(asset.vertices * [1, 2, -3] + 0.1))
    bounds = document["accessors"][0]
    assert bounds["min"] == [float(np.float32(x)) for x in (0.1, 0.1, -2.9)]
    assert bounds["max"] == [float(np.float32(x)) for x in (1.1, 2.1, 0.1)]


def test_the_rest_of_the_json_keeps_its_text():
    gltf = cube_gltf()
    gltf.json["extras"] = {"note": 'a "quoted", [bracketed] {note}', "number": 1e-05}
    gltf.json["buffers"] = [{"byteLength": len(gltf.binary), "uri": "a.bin"}]
    text = json.dumps(gltf.json, indent=3).replace("1e-05", "0.000010")
    asset = read_asset("mesh.gltf", text.encode(), {"a.bin": bytes(gltf.binary)})
    moved = asset.vertices.copy()
    moved[0] *= 0.5
    moved[7] *= 0.5
    moved[3] += [0, 0, 0.25]
    after = asset.patched(moved).decode()
    different = {
        line.split(":")[0].strip()
        for line, other in zip(text.splitlines(), after.splitlines(), strict=False)
        if line != other
    }
    assert '"number": 0.000010' in after
    assert different <= {'"uri"'}


def test_an_embedded_buffer_keeps_its_media_type():
    asset = read(cube_gltf().embedded())
    document = json.loads(asset.patched(asset.vertices + 1))
    assert document["buffers"][0]["uri"].startswith("data:model/x;base64,")


def test_a_separate_buffer_moves_into_the_file():
    gltf = cube_gltf()
    asset = read_asset("mesh.gltf", gltf.separate("a.bin"), {"a.bin": bytes(gltf.binary)})
    again = read_asset("mesh.gltf", asset.patched(asset.vertices + 1))
    assert again.vertices == pytest.approx(asset.vertices + 1)


def test_a_buffer_nothing_moves_in_stays_a_file():
    gltf = cube_gltf()
    document = json.loads(gltf.separate("a.bin"))
    document["buffers"].append({"byteLength": 4, "uri": "animation.bin"})
    resources = {"a.bin": bytes(gltf.binary), "animation.bin": bytes(4)}
    asset = read_asset("mesh.gltf", json.dumps(document).encode(), resources)
    uris = [b["uri"] for b in json.loads(asset.patched(asset.vertices + 1))["buffers"]]
    assert uris[0].startswith("data:")
    assert uris[1] == "animation.bin"


def test_interleaved_attributes_stay_in_place():
    gltf = Gltf()
    rows = np.zeros(3, dtype=[("position", "<f4", 3), ("colour", "<f4", 3)])
    rows["position"], rows["colour"] = TRIANGLE, [0.1, 0.2, 0.3]
    view = gltf.view(rows.tobytes(), stride=24)
    attributes = {
        "POSITION": gltf.accessor(rows["position"], view),
        "COLOR_0": gltf.accessor(rows["colour"], view, offset=12),
    }
    gltf.node(mesh=gltf.mesh({"attributes": attributes}))
    asset = read(gltf.glb())
    after = np.frombuffer(chunks(asset.patched(asset.vertices + 1))[1], rows.dtype)
    assert after["position"].tolist() == (TRIANGLE + 1).tolist()
    assert after["colour"].tolist() == rows["colour"].tolist()


def sparse_triangle() -> Gltf:
    gltf = flat_gltf(TRIANGLE)
    gltf.json["accessors"][0]["sparse"] = {
        "count": 1,
        "indices": {"bufferView": gltf.view(b"\2\0"), "componentType": 5123},
        "values": {"bufferView": gltf.view(struct.pack("<3f", 0, 9, 0))},
    }
    return gltf


def test_sparse_positions_are_written_where_they_are_stored():
    asset = read(sparse_triangle().glb())
    after = asset.patched(asset.vertices + 1)
    assert read(after).vertices.tolist() == (asset.vertices + 1).tolist()
    assert len(chunks(after)[1]) == len(chunks(sparse_triangle().glb())[1])


def sparse_zeros() -> Gltf:
    gltf = sparse_triangle()
    del gltf.json["accessors"][0]["bufferView"], gltf.json["accessors"][0]["byteOffset"]
    gltf.json["accessors"][0]["sparse"] |= {"count": 2}
    gltf.json["accessors"][0]["sparse"]["indices"]["bufferView"] = gltf.view(b"\1\0\2\0")
    values = struct.pack("<6f", 1, 0, 0, 0, 9, 0)
    gltf.json["accessors"][0]["sparse"]["values"]["bufferView"] = gltf.view(values)
    return gltf


def test_zeros_that_are_not_stored_are_when_they_move():
    gltf = sparse_zeros()
    asset = read(gltf.glb())
    data = asset.patched(asset.vertices + 1)
    assert "sparse" not in chunks(data)[0]["accessors"][0]
    assert read(data).vertices == pytest.approx(asset.vertices + 1)


def test_zeros_that_are_not_stored_may_stay():
    gltf = sparse_zeros()
    asset = read(gltf.glb())
    moved = asset.vertices.copy()
    moved[2] += 1
    data = asset.patched(moved)
    assert "bufferView" not in chunks(data)[0]["accessors"][0]
    assert read(data).vertices == pytest.approx(moved)


def quantized() -> Gltf:
    gltf = flat_gltf((TRIANGLE * 100).astype(np.int16))
    gltf.json["nodes"][0]["scale"] = [0.01, 0.01, 0.01]
    gltf.json["extensionsUsed"] = ["KHR_mesh_quantization"]
    return gltf


def test_quantized_positions_go_to_the_nearest_step():
    asset = read(quantized().glb())
    moved = asset.vertices + 0.104
    assert read(asset.patched(moved)).vertices == pytest.approx(asset.vertices + 0.1)


@pytest.mark.parametrize("normalized", [False, True])
def test_quantized_positions_that_leave_their_range_become_floats(normalized):
    gltf = quantized()
    if normalized:
        gltf.json["accessors"][0]["normalized"] = True
        gltf.json["nodes"][0]["scale"] = [327.67, 327.67, 327.67]
    asset = read(gltf.glb())
    moved = asset.vertices.copy()
    moved[1] += [1000, 0, 0]
    data = asset.patched(moved)
    position = chunks(data)[0]["accessors"][0]
    assert position["componentType"] == 5126
    assert not position.get("normalized")
    assert read(data).vertices == pytest.approx(moved, abs=1e-4)
    assert position["max"][0] == pytest.approx(
        moved[1, 0] / chunks(data)[0]["nodes"][0]["scale"][0]
    )


def test_quantized_positions_within_their_range_keep_their_type():
    asset = read(quantized().glb())
    position = chunks(asset.patched(asset.vertices + 0.1))[0]["accessors"][0]
    assert position["componentType"] == 5122


def face_normals(asset) -> np.ndarray:
    a, b, c = (asset.vertices[asset.faces[:, corner]] for corner in range(3))
    normal = np.cross(b - a, c - a)
    return normal / np.linalg.norm(normal, axis=1, keepdims=True)


def world_normals(glb: bytes, linear: np.ndarray) -> np.ndarray:
    normals = floats(glb, 1, 3) @ np.linalg.inv(linear)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


@pytest.mark.parametrize("mirror", [1, -1])
def test_normals_turn_with_the_surface_through_the_nodes_transform(mirror):
    before = cube_gltf(rotation=[0.5, 0.5, 0.5, 0.5], scale=[2, 3, 0.5 * mirror]).glb()
    asset = read(before)
    turn = np.linalg.qr(np.array([[1.0, 2, 3], [0, 1, 4], [5, 6, 0]]))[0]
    after = asset.patched(asset.vertices @ turn.T)
    linear = np.array([[0, 0, 0.5 * mirror], [2.0, 0, 0], [0, 3, 0]])
    flat_shading = np.repeat(face_normals(read(after))[::2], 4, axis=0)
    assert world_normals(after, linear) == pytest.approx(flat_shading, abs=1e-6)


def test_tangents_stay_orthogonal_and_keep_their_hand():
    gltf = cube_gltf()
    normals = floats(gltf.glb(), 1, 3)
    tangents = np.column_stack([np.roll(normals, 1, axis=1), np.full(24, -1)])
    tangent = gltf.accessor(tangents.astype(np.float32))
    gltf.json["meshes"][0]["primitives"][0]["attributes"]["TANGENT"] = tangent
    asset = read(gltf.glb())
    after = asset.patched(asset.vertices @ np.array([[1, 0.2, 0], [0, 1, 0.3], [0.1, 0, 1]]))
    renewed = floats(after, tangent, 4)
    assert (renewed[:, :3] * floats(after, 1, 3)).sum(axis=1) == pytest.approx(0, abs=1e-6)
    assert (renewed[:, 3] == -1).all()


def test_normals_can_be_kept():
    before = cube_gltf().glb()
    asset = read(before)
    after = asset.patched(asset.vertices @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]]), KEEP)
    assert floats(after, 1, 3).tolist() == floats(before, 1, 3).tolist()


def test_unknown_chunks_and_trailing_padding_are_kept():
    glb = cube_gltf().glb()
    extra = struct.pack("<I4s", 4, b"ABCD") + b"data"
    glb = glb[:8] + struct.pack("<I", len(glb) + len(extra)) + glb[12:] + extra
    asset = read(glb)
    after = asset.patched(asset.vertices + 1)
    assert after.endswith(extra)
    assert struct.unpack_from("<I", after, 8) == (len(after),)


def test_only_the_buffer_and_its_bounds_change():
    before = json.loads(cube_gltf().embedded())
    asset = read(cube_gltf().embedded())
    after = json.loads(asset.patched(asset.vertices + 1))
    for document in (before, after):
        del document["buffers"][0]["uri"], document["accessors"][0]["min"]
        del document["accessors"][0]["max"]
    assert before == after
