"""Draco in, plain buffers out; or Draco again, where asked for."""

from __future__ import annotations

import json

import DracoPy
import numpy as np
import pytest

from meshcone.assets import Asset, Limits, WritePolicy, read_asset
from meshcone.errors import InputError, LimitError
from meshcone.notices import Code
from tests.unit.assets.builders import DRACO, Gltf, chunks, compress, cube_gltf, stored

ENCODE = WritePolicy(draco="encode")


def read(data: bytes) -> Asset:
    return read_asset("mesh.glb", data)


def cube() -> Gltf:
    return compress(cube_gltf())


def test_a_compressed_mesh_is_the_mesh_that_was_compressed():
    plain, asset = read(cube_gltf().glb()), read(cube().glb())
    assert asset.positions == pytest.approx(plain.positions, abs=1e-6)
    assert asset.faces.tolist() == plain.faces.tolist()


def test_a_compressed_mesh_may_be_in_a_separate_buffer():
    gltf = cube()
    asset = read_asset("mesh.gltf", gltf.separate("a.bin"), {"a.bin": bytes(gltf.binary)})
    after = read_asset("mesh.gltf", asset.patched(asset.vertices + 1))
    assert after.vertices == pytest.approx(asset.vertices + 1, abs=1e-6)


def test_nothing_moved_gives_the_same_bytes():
    data = cube().glb()
    asset = read(data)
    assert asset.patched(asset.vertices.copy()) == asset.patched(asset.vertices.copy(), ENCODE)
    assert asset.patched(asset.vertices.copy()) == data


def test_it_is_written_as_plain_buffers():
    asset = read(cube().glb())
    data = asset.patched(asset.vertices * 2 + 1)
    document, binary = chunks(data)
    assert "extensionsUsed" not in document
    assert "extensionsRequired" not in document
    assert "extensions" not in document["meshes"][0]["primitives"][0]
    assert read(data).vertices == pytest.approx(asset.vertices * 2 + 1)
    assert document["accessors"][0]["max"] == pytest.approx([3, 3, 3])
    assert document["buffers"][0]["byteLength"] == len(binary)


def test_plain_buffers_keep_texture_coordinates_and_indices():
    before = read(cube_gltf().glb())
    expected = chunks(before.patched(before.vertices + 1))
    asset = read(cube().glb())
    found = chunks(asset.patched(asset.vertices + 1))
    for accessor, width in ((2, 8), (3, 2)):
        assert elements(*found, accessor, width) == elements(*expected, accessor, width)


def elements(document: dict, binary: bytes, accessor: int, width: int) -> bytes:
    declared = document["accessors"][accessor]
    start = document["bufferViews"][declared["bufferView"]]["byteOffset"]
    return binary[start : start + width * declared["count"]]


def test_the_bitstream_leaves_no_dead_bytes_behind():
    asset = read(cube().glb())
    document, binary = chunks(asset.patched(asset.vertices + 1))
    covered = np.zeros(len(binary), dtype=bool)
    for view in document["bufferViews"]:
        covered[view["byteOffset"] : view["byteOffset"] + view["byteLength"]] = True
        assert view["byteOffset"] % 4 == 0
    stale = len(cube_gltf().binary)  # what the builder leaves of the plain mesh
    assert np.count_nonzero(~covered) < 64
    assert len(binary) < 2 * stale + 64


def test_views_behind_a_bitstream_follow_their_bytes():
    gltf = cube()
    note = gltf.view(b"a note of an odd length")
    gltf.json["images"] = [{"bufferView": note, "mimeType": "image/png"}]
    asset = read(gltf.glb())
    for policy in (WritePolicy(), ENCODE):
        document, binary = chunks(asset.patched(asset.vertices + 1, policy))
        view = document["bufferViews"][note]
        start = view["byteOffset"]
        assert binary[start : start + view["byteLength"]] == b"a note of an odd length"


def test_it_is_compressed_again_where_asked_to():
    gltf = cube()
    asset = read(gltf.glb())
    data = asset.patched(asset.vertices * 2 + 1, ENCODE)
    before, (after, _) = gltf.json, chunks(data)
    assert read(data).vertices == pytest.approx(asset.vertices * 2 + 1, abs=2 / 2**16)
    assert "bufferView" not in after["accessors"][0]
    for document in (before, after):
        del document["accessors"][0]["min"], document["accessors"][0]["max"]
        del document["buffers"], document["bufferViews"]
        document["meshes"][0]["primitives"][0]["extensions"][DRACO].pop("attributes")
    assert after == before


def test_integers_are_compressed_again_as_they_are():
    gltf = cube_gltf()
    values = np.frombuffer(bytes(gltf.binary), "<f4", 72).reshape(-1, 3)
    position = gltf.accessor(np.pad((values * 100).astype("i2"), ((0, 0), (0, 1)))[:, :3])
    gltf.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = position
    gltf.json["nodes"][0]["scale"] = [0.01, 0.01, 0.01]
    compress(gltf)
    gltf.json["extensionsUsed"].append("KHR_mesh_quantization")
    asset = read(gltf.glb())
    after = read(asset.patched(asset.vertices * 2 + 0.07, ENCODE))
    assert after.vertices == pytest.approx(asset.vertices * 2 + 0.07)
    data = asset.patched(asset.vertices * 1000, ENCODE)
    assert chunks(data)[0]["accessors"][position]["componentType"] == 5126
    assert read(data).vertices == pytest.approx(asset.vertices * 1000, abs=1000 / 2**16)


def two_orders() -> Gltf:
    """Two cubes whose exporter gave them one index accessor before it put each in its own order."""
    gltf = cube_gltf()
    first = gltf.json["meshes"][0]["primitives"][0]
    rows = np.random.default_rng(3).permutation(24)
    attributes = {}
    for name, index in first["attributes"].items():
        values = stored(gltf, index)[rows]
        attributes[name] = gltf.accessor(values + np.float32(2 * (name == "POSITION")))
    again = np.argsort(rows)[stored(gltf, first["indices"])].astype(np.uint16)
    second = {"attributes": attributes, "indices": gltf.accessor(again)}
    gltf.node(mesh=gltf.mesh(second))
    compress(compress(gltf), mesh=1)
    second["indices"] = first["indices"]
    return gltf


def test_each_bitstream_has_indices_of_its_own_where_its_document_shares_them():
    asset = read(two_orders().glb())
    expected = read(cube_gltf().glb())
    corners = expected.vertices[expected.faces]
    found = asset.vertices[asset.faces]
    assert found == pytest.approx(np.concatenate([corners, corners + 2]), abs=1e-5)


@pytest.mark.parametrize("policy", [WritePolicy(), ENCODE])
def test_what_shared_its_indices_is_written_with_indices_of_its_own(policy):
    asset = read(two_orders().glb())
    moved = asset.vertices * 3
    after = read(asset.patched(moved, policy))
    before = moved[asset.faces]
    assert after.vertices[after.faces] == pytest.approx(before, abs=9 / 2**16)


def miscounted(vertices: int, indices: int) -> Gltf:
    """A cube whose document declares other counts than it has."""
    gltf = cube()
    for accessor in gltf.json["accessors"][:3]:
        accessor["count"] = vertices
    gltf.json["accessors"][3]["count"] = indices
    return gltf


@pytest.mark.parametrize("declared", [(20, 36), (30, 36), (24, 39)])
def test_what_a_bitstream_holds_counts_and_not_what_the_document_declares(declared):
    asset = read(miscounted(*declared).glb())
    expected = read(cube().glb())
    assert asset.positions.tolist() == expected.positions.tolist()
    assert asset.faces.tolist() == expected.faces.tolist()
    assert [each.code for each in asset.warnings] == [Code.ACCESSORS_COUNT]


@pytest.mark.parametrize("policy", [WritePolicy(), ENCODE])
def test_counts_are_put_right_where_a_mesh_is_written(policy):
    asset = read(miscounted(20, 39).glb())
    written = asset.patched(asset.vertices + 1, policy)
    counts = [accessor["count"] for accessor in chunks(written)[0]["accessors"]]
    assert counts == [24, 24, 24, 36]
    assert read(written).vertices == pytest.approx(asset.vertices + 1, abs=2 / 2**16)
    assert not read(written).warnings


def test_more_vertices_than_are_declared_count_against_the_limits():
    with pytest.raises(LimitError):
        read_asset("mesh.glb", miscounted(20, 36).glb(), limits=Limits(vertices=22))


def test_a_bitstream_two_meshes_read_cannot_be_compressed_again():
    gltf = cube()
    gltf.json["meshes"].append(json.loads(json.dumps(gltf.json["meshes"][0])))
    with pytest.raises(InputError, match="shares its Draco data"):
        read(gltf.glb()).ensure_writable(ENCODE)


def test_declared_bounds_are_those_of_what_decompresses():
    asset = read(cube().glb())
    data = asset.patched(asset.vertices * np.pi, ENCODE)
    bounds = chunks(data)[0]["accessors"][0]
    assert bounds["max"] == read(data).positions.max(axis=0).tolist()


def test_seams_between_compressed_primitives_stay_closed():
    gltf = cube_gltf()
    half = {"attributes": dict(gltf.json["meshes"][0]["primitives"][0]["attributes"])}
    for name, index in half["attributes"].items():
        values = np.frombuffer(bytes(gltf.binary), "<f4")[: 24 * 3].reshape(-1, 3)
        if name == "POSITION":
            half["attributes"][name] = gltf.accessor(values + np.float32([1, 0, 0]))
        else:
            gltf.json["accessors"].append(dict(gltf.json["accessors"][index]))
            half["attributes"][name] = len(gltf.json["accessors"]) - 1
    gltf.json["accessors"].append(dict(gltf.json["accessors"][3]))
    half["indices"] = len(gltf.json["accessors"]) - 1
    gltf.json["meshes"][0]["primitives"].append(half)
    asset = read(compress(compress(gltf), primitive=1).glb())
    assert asset.counts().welded_vertices == 12
    moved = asset.vertices + np.random.default_rng(1).normal(scale=0.1, size=(12, 3))
    after = read(asset.patched(moved, ENCODE))
    assert after.counts().welded_vertices == 12


def test_a_plain_copy_is_what_is_read_and_both_are_written():
    gltf = compress(cube_gltf(), keep_copy=True)
    asset = read(gltf.glb())
    data = asset.patched(asset.vertices + 0.5, ENCODE)
    document, binary = chunks(data)
    draco = document["meshes"][0]["primitives"][0]["extensions"][DRACO]
    view = document["bufferViews"][draco["bufferView"]]
    start = view["byteOffset"]
    mesh = DracoPy.decode(binary[start : start + view["byteLength"]])
    assert mesh.points == pytest.approx(read(data).positions, abs=1e-4)
    assert read(data).vertices == pytest.approx(asset.vertices + 0.5)


def test_a_mention_that_nothing_follows_from_stays():
    gltf = cube_gltf()
    gltf.json["extensionsUsed"] = [DRACO]
    asset = read(gltf.glb())
    assert chunks(asset.patched(asset.vertices + 1))[0]["extensionsUsed"] == [DRACO]


def test_the_report_can_say_what_becomes_of_it():
    asset = read(cube().glb())
    for policy, words in ((WritePolicy(), "plain buffers"), (ENCODE, "16 bits")):
        written = read(asset.patched(asset.vertices + 1, policy))
        assert words in asset.changes(policy, written)[0].words


def test_copies_cannot_be_compressed():
    gltf = cube()
    gltf.node(mesh=0, translation=[5, 0, 0])
    asset = read(gltf.glb())
    asset.ensure_writable(WritePolicy(instances="split"))
    with pytest.raises(InputError, match="draco=plain"):
        asset.ensure_writable(WritePolicy(instances="split", draco="encode"))
