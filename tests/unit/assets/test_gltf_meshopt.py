"""Buffer views compressed with meshopt in, plain ones out."""

from __future__ import annotations

from typing import Any

import meshopt
import numpy as np
import pytest

from meshcone.assets import Asset, Limits, WritePolicy, read_asset
from meshcone.errors import InputError, LimitError
from meshcone.notices import Code
from tests.unit.assets.builders import Gltf, chunks, compress, cube_gltf, stored
from tests.unit.assets.squeezing import EXT, squeezed


def read(gltf: Gltf, **limits: int) -> Asset:
    return read_asset("mesh.glb", gltf.glb(), limits=Limits(**limits))


@pytest.mark.parametrize(
    ("name", "version"), [(EXT, 0), ("KHR_meshopt_compression", 0), ("KHR_meshopt_compression", 1)]
)
@pytest.mark.parametrize("accessors", [None, [0], [3], [1, 3]])
def test_what_was_compressed_is_read_as_it_was(
    name: str, version: int, accessors: list[int] | None
) -> None:
    plain = read(cube_gltf())
    asset = read(squeezed(cube_gltf(), accessors, name=name, version=version))
    assert np.array_equal(asset.positions, plain.positions)
    corners, theirs = asset.positions[asset.triangles], plain.positions[plain.triangles]
    # The codec may turn a triangle, which leaves its corners in their cycle.
    first = np.lexsort(theirs.reshape(-1, 9).T)
    turns = [np.roll(corners, turn, axis=1).reshape(-1, 9) for turn in range(3)]
    for triangle in theirs.reshape(-1, 9)[first]:
        assert any((turned == triangle).all(axis=1).any() for turned in turns)


def test_it_is_written_plainly_and_nothing_mentions_the_extension() -> None:
    gltf = squeezed(cube_gltf())
    gltf.json["images"] = [{"bufferView": gltf.view(b"a picture"), "mimeType": "image/png"}]
    asset = read(gltf)

    written = asset.patched(asset.vertices * 1.5 + 1)

    document, binary = chunks(written)
    assert b"meshopt" not in written
    assert len(document["buffers"]) == 1
    view = document["bufferViews"][document["images"][0]["bufferView"]]
    start = view["byteOffset"]
    assert binary[start : start + view["byteLength"]] == b"a picture"
    again = read_asset("mesh.glb", written)
    told = asset.changes(WritePolicy(), again)
    assert [notice.code for notice in told] == [Code.WRITING_MESHOPT]
    assert np.allclose(again.vertices, asset.vertices * 1.5 + 1)
    uv = asset.content().draws[0].attributes["TEXCOORD_0"].at_corners()
    assert np.array_equal(again.content().draws[0].attributes["TEXCOORD_0"].at_corners(), uv)


def test_where_nothing_moved_the_file_stays_compressed() -> None:
    data = squeezed(cube_gltf()).glb()
    asset = read_asset("mesh.glb", data)
    assert asset.patched(asset.vertices) == data


@pytest.mark.parametrize("bits", [16, 23])
def test_exponents_are_undone(bits: int) -> None:
    gltf = cube_gltf()
    values = stored(gltf, 0) * np.float32(1 / 3) + np.float32(0.1)
    filtered = {0: ("EXPONENTIAL", meshopt.encode_filter_exp(values, bits).view("u4"))}
    asset = read(squeezed(gltf, filtered=filtered))
    assert np.abs(asset.positions - values).max() <= 2.0 ** (2 - bits)


def test_octahedral_normals_are_undone() -> None:
    gltf = cube_gltf()
    turned = stored(gltf, 1) @ np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    rows = np.column_stack([turned, np.ones(len(turned))]).astype(np.float32)
    filtered = {1: ("OCTAHEDRAL", meshopt.encode_filter_oct(rows, 8, 16).view("i2"))}
    packed = squeezed(gltf, filtered=filtered)
    packed.json["accessors"][1] |= {"componentType": 5122, "normalized": True}
    packed.json["extensionsUsed"].append("KHR_mesh_quantization")
    asset = read(packed)
    normals = asset.content().draws[0].attributes["NORMAL"].read(np.arange(24))
    assert np.abs(normals - turned).max() < 1e-3


def test_a_plain_copy_is_the_one_that_is_read() -> None:
    gltf = squeezed(cube_gltf(), [0])
    plain = bytes(cube_gltf().binary)[: 24 * 12]
    moved = (np.frombuffer(plain, "<f4") + 5).astype("<f4").tobytes()
    gltf.json["buffers"][1] = {"byteLength": len(moved), "uri": "fallback.bin"}
    document = gltf.glb()

    asset = read_asset("mesh.glb", document, {"fallback.bin": moved})

    assert np.array_equal(asset.positions, read(cube_gltf()).positions + 5)
    again = read_asset("mesh.glb", asset.patched(asset.vertices + 1), {"fallback.bin": moved})
    assert np.allclose(again.vertices, asset.vertices + 1)


def test_it_may_stand_beside_draco() -> None:
    gltf = cube_gltf()
    other = gltf.accessor(np.eye(3, dtype=np.float32) + 4)
    gltf.json["meshes"][0]["primitives"].append({"attributes": {"POSITION": other}})
    draco = squeezed_views(compress(gltf), other)
    asset = read_asset("mesh.glb", draco.glb())
    assert asset.counts().faces == 13
    for policy in (WritePolicy(), WritePolicy(draco="encode")):
        again = read_asset("mesh.glb", asset.patched(asset.vertices + 1, policy))
        assert np.allclose(again.vertices, asset.vertices + 1, atol=1e-4)


def squeezed_views(gltf: Gltf, accessor: int) -> Gltf:
    """The document with the view of one accessor compressed, the others where they are."""
    view = gltf.json["bufferViews"][gltf.json["accessors"][accessor]["bufferView"]]
    rows = stored(gltf, accessor)
    bits = meshopt.encode_gltf_buffer(rows, "ATTRIBUTES")
    placed = gltf.json["bufferViews"][gltf.view(bits)]
    gltf.json["bufferViews"].pop()
    extension = {"count": len(rows), "byteStride": 12, "mode": "ATTRIBUTES"} | placed
    view |= {"buffer": 1, "byteOffset": 0, "extensions": {EXT: extension}}
    gltf.json["buffers"].append({"byteLength": 36, "extensions": {EXT: {"fallback": True}}})
    gltf.json["extensionsUsed"].append(EXT)
    return gltf


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("mode", "POINTS", "expected one of ATTRIBUTES, TRIANGLES, INDICES, found 'POINTS'"),
        ("filter", "BLUR", "expected one of NONE, .*, found 'BLUR'"),
        ("filter", "QUATERNION", "'QUATERNION' has no elements of 12"),
        ("byteStride", 10, "a multiple of 4 up to 256, found 10"),
        ("byteStride", 8, "24 elements of 8 bytes are 192 bytes, the view declares 288"),
        ("count", 10**12, "the view declares 288"),
        ("byteLength", 10**9, "ends at byte"),
        ("byteOffset", 10**9, "ends at byte"),
        ("buffer", 7, "names buffer 7"),
        ("byteLength", 9, "the meshopt data are damaged"),
    ],
)
def test_what_is_declared_wrongly_is_refused(key: str, value: Any, message: str) -> None:
    gltf = squeezed(cube_gltf())
    gltf.json["bufferViews"][0]["extensions"][EXT][key] = value
    with pytest.raises(InputError, match=message) as caught:
        read(gltf)
    assert (caught.value.place or "").startswith("/bufferViews/0")


def test_what_it_decompresses_to_counts_against_the_limits() -> None:
    gltf = squeezed(cube_gltf())
    gltf.json["accessors"].append({"componentType": 5126, "type": "VEC4", "count": 60_000})
    view = {"buffer": 1, "byteLength": 960_000, "extensions": {EXT: {}}}
    view["extensions"][EXT] = gltf.json["bufferViews"][0]["extensions"][EXT] | {
        "count": 60_000,
        "byteStride": 16,
    }
    gltf.json["bufferViews"].append(view)
    with pytest.raises(LimitError, match="bytes when decompressed"):
        read(gltf, file_bytes=100_000)


ENCODE = WritePolicy(meshopt="encode")


def streams(data: bytes) -> dict[int, tuple[dict[str, Any], bytes]]:
    """What the extension says of each compressed view, without its place, and the stream."""
    document, binary = chunks(data)
    found = {}
    for index, view in enumerate(document["bufferViews"]):
        if "extensions" in view:
            said = dict(view["extensions"][EXT])
            assert said.pop("buffer") == 0
            start, length = said.pop("byteOffset"), said.pop("byteLength")
            found[index] = (said, binary[start : start + length])
    return found


def test_what_did_not_move_keeps_its_streams_where_it_is_compressed_again() -> None:
    data = squeezed(cube_gltf()).glb()
    asset = read_asset("mesh.glb", data)

    written = asset.patched(asset.vertices * 1.5 + 1, ENCODE)

    again = read_asset("mesh.glb", written)
    assert np.allclose(again.vertices, asset.vertices * 1.5 + 1)
    before, after = streams(data), streams(written)
    assert sorted(after) == sorted(before) == [0, 1, 2, 3]
    assert [number for number in after if after[number] != before[number]] == [0]
    told = asset.changes(ENCODE, again)
    assert [notice.code for notice in told] == [Code.WRITING_MESHOPT]


def test_a_document_that_is_compressed_again_says_what_it_said() -> None:
    gltf = squeezed(cube_gltf())
    gltf.json["images"] = [{"bufferView": gltf.view(b"a picture"), "mimeType": "image/png"}]
    asset = read(gltf)

    document, binary = chunks(asset.patched(asset.vertices + 1, ENCODE))

    for key in ("buffers", "bufferViews"):
        for before, after in zip(gltf.json[key], document[key], strict=True):
            for said in (before, after):
                stream = said.get("extensions", {}).get(EXT, said)
                for place in ("byteOffset", "byteLength"):
                    stream.pop(place, None)
    for said in (gltf.json, document):
        del said["accessors"][0]["min"], said["accessors"][0]["max"]
    assert document == gltf.json
    assert b"a picture" in binary


def test_a_filter_that_would_round_is_left_out_of_what_is_compressed_again() -> None:
    gltf = cube_gltf()
    values = stored(gltf, 0) * np.float32(1 / 3)
    filtered = {0: ("EXPONENTIAL", meshopt.encode_filter_exp(values, 12).view("u4"))}
    asset = read(squeezed(gltf, filtered=filtered))
    target = asset.vertices + np.random.default_rng(2).normal(scale=0.01, size=(8, 3))

    written = asset.patched(target, ENCODE)

    assert "filter" not in streams(written)[0][0]
    assert np.abs(read_asset("mesh.glb", written).vertices - target).max() < 1e-7


def test_positions_that_no_longer_fit_their_integers_are_compressed_as_floats() -> None:
    gltf = cube_gltf()
    values = np.pad((stored(gltf, 0) * 32767).astype("i2"), ((0, 0), (0, 1)))
    accessor = gltf.json["accessors"][0]
    accessor |= {"bufferView": gltf.view(values.tobytes(), stride=8), "componentType": 5122}
    accessor |= {"normalized": True, "min": [0] * 3, "max": [32767] * 3, "type": "VEC4"}
    packed = squeezed(gltf)
    packed.json["accessors"][0]["type"] = "VEC3"
    packed.json["extensionsUsed"].append("KHR_mesh_quantization")
    asset = read(packed)

    written = asset.patched(asset.vertices * 3, ENCODE)

    assert np.allclose(read_asset("mesh.glb", written).vertices, asset.vertices * 3)
    document, _ = chunks(written)
    view = document["accessors"][0]["bufferView"]
    assert view >= len(packed.json["bufferViews"])
    assert streams(written)[view][0] == {"byteStride": 12, "count": 24, "mode": "ATTRIBUTES"}
    fallback = document["buffers"][document["bufferViews"][view]["buffer"]]
    assert fallback["extensions"] == {EXT: {"fallback": True}}
    assert document["bufferViews"][view]["byteOffset"] + 24 * 12 <= fallback["byteLength"]


def test_a_copy_that_was_plain_stays_plain_where_the_rest_is_compressed_again() -> None:
    gltf = squeezed(cube_gltf(), [0])
    plain = bytes(cube_gltf().binary)[: 24 * 12]
    gltf.json["buffers"][1] = {"byteLength": len(plain), "uri": "fallback.bin"}
    asset = read_asset("mesh.glb", gltf.glb(), {"fallback.bin": plain})

    written = asset.patched(asset.vertices + 1, ENCODE)

    assert not streams(written)
    assert np.allclose(read_asset("mesh.glb", written).vertices, asset.vertices + 1)


@pytest.mark.parametrize("compressed", [None, [0]])
def test_a_buffer_that_writing_adds_stands_behind_those_to_decompress_into(
    compressed: list[int] | None,
) -> None:
    gltf = squeezed(cube_gltf(), compressed)
    gltf.node(mesh=0, translation=[5, 0, 0])
    past = {"buffer": 0, "byteOffset": len(gltf.binary), "byteLength": 600_000}
    gltf.json["bufferViews"].append(past)  # it must not begin to read what is appended
    asset = read(gltf)
    moved = asset.vertices + np.random.default_rng(3).uniform(-0.1, 0.1, asset.vertices.shape)

    written = asset.patched(moved, WritePolicy(instances="split", meshopt="encode"))

    assert np.allclose(read_asset("mesh.glb", written).vertices, moved)
    _, reserved, *added = chunks(written)[0]["buffers"]
    assert reserved["extensions"][EXT] == {"fallback": True}
    assert added
    assert all("uri" in buffer for buffer in added)


@pytest.mark.parametrize("policy", [WritePolicy(), ENCODE])
def test_a_number_that_no_double_holds_stays_as_it_is_written(policy: WritePolicy) -> None:
    gltf = squeezed(cube_gltf())
    gltf.json["bufferViews"][0]["extras"] = gltf.json["buffers"][0]["extras"] = {"seed": 12345}
    asset = read_asset("mesh.glb", gltf.glb().replace(b"12345", b"1e400"))

    written = asset.patched(asset.vertices + 1, policy)

    assert written.count(b"1e400") == 2
    assert b"Infinity" not in written
