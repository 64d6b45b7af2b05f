"""What several nodes or meshes share becomes a copy for each that moves."""

from __future__ import annotations

import copy

import numpy as np
import pytest

from meshcone.assets import Asset, Limits, WritePolicy, read_asset
from meshcone.errors import InputError, LimitError
from meshcone.options import parse_options
from tests.unit.assets.builders import Gltf, chunks, cube_gltf

SPLIT = WritePolicy(instances="split")


def read(data: bytes) -> Asset:
    return read_asset("mesh.glb", data)


def two_cubes() -> Gltf:
    """One mesh at two nodes, the second mirrored."""
    gltf = cube_gltf(translation=[1, 2, 3])
    gltf.node(mesh=0, translation=[5, 0, 0], scale=[-1, 2, 1])
    return gltf


def drift(asset: Asset) -> np.ndarray:
    """A move that is different at every vertex."""
    return asset.vertices + np.random.default_rng(3).uniform(-0.1, 0.1, asset.vertices.shape)


def test_each_node_gets_a_mesh_of_its_own():
    asset = read(two_cubes().glb())
    moved = drift(asset)
    after = read(asset.patched(moved, SPLIT))
    assert after.positions == pytest.approx(moved[asset.weld], abs=1e-6)
    assert after.faces.tolist() == asset.faces.tolist()
    after.ensure_writable()


def test_the_first_node_keeps_the_mesh_and_nothing_else_changes():
    before, _ = chunks(two_cubes().glb())
    asset = read(two_cubes().glb())
    after, _ = chunks(asset.patched(drift(asset), SPLIT))
    assert [node["mesh"] for node in after["nodes"]] == [0, 1]
    copied = copy.deepcopy(after["meshes"].pop())
    assert copied["name"] == "Cube"
    assert copied["primitives"][0]["indices"] == 3
    assert copied["primitives"][0]["attributes"] == {"POSITION": 4, "NORMAL": 5, "TEXCOORD_0": 2}
    del after["accessors"][4:], after["bufferViews"][4:]
    for document in (before, after):
        for bounds in document["accessors"][:2]:
            del bounds["min"], bounds["max"]
        del document["nodes"], document["buffers"]
    assert after == before


def test_texture_coordinates_and_indices_stay_shared_bytes():
    _, before = chunks(two_cubes().glb())
    asset = read(two_cubes().glb())
    _, after = chunks(asset.patched(drift(asset), SPLIT))
    assert after[2 * 24 * 12 : len(before)] == before[2 * 24 * 12 :]
    assert len(after) == len(before) + 2 * 24 * 12


def test_a_mirrored_copy_keeps_its_winding_and_outward_normals():
    asset = read(two_cubes().glb())
    after = read(asset.patched(asset.vertices * 1.5, SPLIT))
    a, b, c = (after.vertices[after.faces[:, corner]] for corner in range(3))
    inward = []
    for cube in (after.faces.max(axis=1) < 8, after.faces.min(axis=1) >= 8):
        centre = after.vertices[after.faces[cube]].mean(axis=(0, 1))
        normals = np.cross(b - a, c - a)[cube]
        inward.append((normals * (a[cube] - centre)).sum(axis=1).min() < 0)
    assert inward == [False, False]


def test_without_being_asked_nothing_is_split():
    asset = read(two_cubes().glb())
    with pytest.raises(InputError, match="instances=split"):
        asset.patched(drift(asset))


def test_where_nothing_moves_nothing_is_split():
    data = two_cubes().glb()
    asset = read(data)
    assert asset.patched(asset.vertices.copy(), SPLIT) == data


def test_a_node_of_another_scene_keeps_the_shared_mesh():
    gltf = cube_gltf()
    other = gltf.node(root=False, mesh=0)
    gltf.json["scenes"].append({"nodes": [other]})
    asset = read(gltf.glb())
    after, binary = chunks(asset.patched(drift(asset), SPLIT))
    assert [node["mesh"] for node in after["nodes"]] == [1, 0]
    assert binary[: len(gltf.binary)] == gltf.binary


def test_meshes_that_share_positions_get_their_own():
    gltf = cube_gltf()
    gltf.node(mesh=gltf.mesh(*gltf.json["meshes"][0]["primitives"]), translation=[5, 0, 0])
    asset = read(gltf.glb())
    moved = drift(asset)
    after = read(asset.patched(moved, SPLIT))
    assert after.positions == pytest.approx(moved[asset.weld], abs=1e-6)


def test_a_primitive_without_positions_claims_no_normals():
    gltf = two_cubes()
    [primitive] = gltf.json["meshes"][0]["primitives"]
    normals = primitive["attributes"]["NORMAL"]
    gltf.json["meshes"][0]["primitives"].append({"attributes": {"NORMAL": normals}})
    asset = read(gltf.glb())
    moved = drift(asset)
    after = read(asset.patched(moved, SPLIT))
    assert after.positions == pytest.approx(moved[asset.weld], abs=1e-6)


def test_positions_that_are_also_a_morph_target_are_copied():
    gltf = cube_gltf()
    gltf.json["meshes"][0]["primitives"][0]["targets"] = [{"POSITION": 0}]
    asset = read(gltf.glb())
    after, binary = chunks(asset.patched(drift(asset), SPLIT))
    primitive = after["meshes"][0]["primitives"][0]
    assert primitive["attributes"]["POSITION"] == 4
    assert primitive["targets"] == [{"POSITION": 0}]
    assert binary[: 24 * 12] == gltf.binary[: 24 * 12]


def test_a_sparse_accessor_is_copied_in_full():
    gltf = two_cubes()
    gltf.json["accessors"][0]["sparse"] = {
        "count": 1,
        "indices": {"bufferView": gltf.view(b"\2\0"), "componentType": 5123},
        "values": {"bufferView": gltf.view(np.array([0.5, 1.5, 0], "<f4").tobytes())},
    }
    asset = read(gltf.glb())
    moved = drift(asset)
    data = asset.patched(moved, SPLIT)
    assert "sparse" not in chunks(data)[0]["accessors"][4]
    assert read(data).positions == pytest.approx(moved[asset.weld], abs=1e-6)


def test_only_a_selected_node_is_split_off():
    gltf = two_cubes()
    gltf.json["nodes"][1]["name"] = "right"
    asset = read(gltf.glb())
    options = parse_options({"instances": "split", "select": {"nodes": ["right"]}})
    after, binary = chunks(asset.patched(drift(asset), asset.policy(options)))
    assert [node["mesh"] for node in after["nodes"]] == [0, 1]
    assert binary[: len(gltf.binary)] == gltf.binary


def test_copies_count_against_the_limit_on_json():
    gltf = cube_gltf()
    gltf.json["meshes"][0]["extras"] = "x" * 50_000
    for _ in range(99):
        gltf.node(mesh=0)
    asset = read_asset("mesh.glb", gltf.glb(), limits=Limits(json_bytes=10**6))
    with pytest.raises(LimitError, match="JSON after copying"):
        asset.ensure_writable(SPLIT)


def test_the_report_can_say_what_was_split():
    asset = read(two_cubes().glb())
    (notice,) = asset.changes(SPLIT, read(asset.patched(drift(asset), SPLIT)))
    assert notice.words.endswith("added: 1 mesh and 2 accessors")


def test_bytes_of_a_separate_buffer_move_into_the_document():
    gltf = two_cubes()
    asset = read_asset("mesh.gltf", gltf.separate("a.bin"), {"a.bin": bytes(gltf.binary)})
    moved = drift(asset)
    after = read_asset("mesh.gltf", asset.patched(moved, SPLIT))
    assert after.positions == pytest.approx(moved[asset.weld], abs=1e-6)


@pytest.mark.parametrize("number", ["1e400", "-1E+999", "1" + 400 * "0" + ".0", "[1e999, 2]"])
def test_a_number_that_no_double_holds_is_copied_as_it_is_written(number: str) -> None:
    gltf = two_cubes()
    gltf.json["meshes"][0]["extras"] = {"size": "here"}
    before = gltf.embedded().replace(b'"here"', number.encode())
    asset = read_asset("mesh.gltf", before)

    after = asset.patched(drift(asset), SPLIT)

    assert b"Infinity" not in after
    assert after.count(number.encode()) == 2
    assert len(read_asset("mesh.gltf", after).faces) == len(asset.faces)
