"""What writing changes of how a glTF stores its data is told, and what nobody knows is kept."""

from __future__ import annotations

import base64
import copy
import json
from collections.abc import Callable
from typing import Literal

import numpy as np
import pytest
from numpy.typing import NDArray

from meshcone.assets import Asset, WritePolicy, read_asset
from meshcone.notices import Code, Notice
from tests.unit.assets.bisecting import bisected
from tests.unit.assets.builders import CUBE, Gltf, chunks, compress, cube_gltf, flat_gltf
from tests.unit.assets.squeezing import squeezed

TRIANGLES = np.array([[0, 2, 1], [1, 2, 3], [0, 1, 4], [1, 5, 4]])
AUTO = WritePolicy(instances="auto")


def told(asset: Asset, resources: dict[str, bytes] | None = None) -> list[Notice]:
    """What is said when every vertex has moved by a tenth."""
    written = asset.patched(asset.vertices * 1.1, AUTO)
    return list(asset.changes(AUTO, read_asset(asset.name, written, resources or {})))


def quantised() -> Gltf:
    gltf = flat_gltf((CUBE * 32767).astype(np.int16), TRIANGLES)
    gltf.json["accessors"][0]["normalized"] = True
    gltf.json["extensionsUsed"] = ["KHR_mesh_quantization"]
    return gltf


def sparse() -> Gltf:
    """Positions that are zero where they are not stored, all of which move."""
    gltf = flat_gltf(CUBE.astype(np.float32), TRIANGLES)
    accessor = gltf.json["accessors"][0]
    accessor["sparse"] = {
        "count": 7,
        "indices": {"bufferView": gltf.view(bytes(range(1, 8))), "componentType": 5121},
        "values": {"bufferView": gltf.view(CUBE[1:].astype("<f4").tobytes())},
    }
    del accessor["bufferView"], accessor["byteOffset"]
    return gltf


def test_integers_that_become_floats_are_told() -> None:
    assert told(read_asset("mesh.glb", quantised().glb())) == [
        Notice(Code.WRITING_STORAGE, "stored in another type: accessor 0 (SHORT to FLOAT)")
    ]


def test_a_sparse_accessor_that_is_stored_in_full_is_told() -> None:
    asset = read_asset("mesh.glb", sparse().glb())
    written = asset.patched(asset.vertices + 0.1, AUTO)
    assert list(asset.changes(AUTO, read_asset("mesh.glb", written))) == [
        Notice(Code.WRITING_STORAGE, "sparse, and stored in full: accessor 0")
    ]


def test_a_buffer_that_moves_into_the_document_is_told() -> None:
    gltf = cube_gltf()
    files = {"a b.bin": bytes(gltf.binary)}
    asset = read_asset("mesh.gltf", gltf.separate("a%20b.bin"), files)
    assert told(asset, files) == [
        Notice(
            Code.WRITING_STORAGE,
            "buffers that were files of their own, and are data in the document: 'a%20b.bin'",
        )
    ]


@pytest.mark.parametrize("make", [Gltf.glb, Gltf.embedded])
def test_nothing_is_told_where_all_is_stored_as_it_was(make: Callable[[Gltf], bytes]) -> None:
    data = make(cube_gltf())
    name = "mesh.glb" if data.startswith(b"glTF") else "mesh.gltf"
    assert told(read_asset(name, data)) == []


def test_a_long_list_is_cut_short() -> None:
    gltf = quantised()
    for number in range(1, 5):
        positions = gltf.accessor((CUBE * 32767).astype(np.int16), normalized=True)
        primitive = gltf.json["meshes"][0]["primitives"][0] | {
            "attributes": {"POSITION": positions}
        }
        gltf.node(mesh=gltf.mesh(primitive), translation=[3 * number, 0, 0])
    (notice,) = told(read_asset("mesh.glb", gltf.glb()))
    assert notice.words.endswith("accessor 3 (SHORT to FLOAT) and 2 more")


def test_what_dividing_stores_in_another_way_is_told() -> None:
    asset = read_asset("mesh.glb", quantised().glb())
    notices = asset.division_notices(bisected(asset.faces, [0]))
    assert [notice.words for notice in notices] == [
        "stored in another type: accessor 0 (SHORT to FLOAT)"
    ]


def one_accessor_for_two() -> Gltf:
    """A cube whose normals are its positions, which have to part."""
    gltf = cube_gltf()
    gltf.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = 0
    return gltf


def moved(asset: Asset) -> NDArray[np.float64]:
    return np.asarray(asset.vertices * (1, 1, 3), dtype=np.float64)


def with_beyond(gltf: Gltf, beyond: bytes) -> bytes:
    """A GLB whose chunk has bytes behind those that its buffer declares."""
    length = len(gltf.binary)
    longer = copy.deepcopy(gltf)
    longer.binary += bytes(-length % 4) + beyond
    declared = b'{"byteLength": %d'
    return longer.glb().replace(declared % len(longer.binary), declared % length)


@pytest.mark.parametrize("beyond", [b"BEYOND!!", b"\0\0\0\0more"])
def test_bytes_behind_the_buffer_of_a_glb_stay_behind_it(beyond: bytes) -> None:
    gltf = one_accessor_for_two()
    asset = read_asset("mesh.glb", with_beyond(gltf, beyond))

    document, binary = chunks(asset.patched(moved(asset), AUTO))

    grown = document["buffers"][0]["byteLength"]
    assert grown > len(gltf.binary)
    assert binary[grown:].strip(b"\0") == beyond.strip(b"\0")


@pytest.mark.parametrize("make", [compress, squeezed])
@pytest.mark.parametrize("how", ["plain", "encode"])
def test_bytes_behind_a_buffer_of_compressed_data_stay_behind_it(
    make: Callable[[Gltf], Gltf], how: Literal["plain", "encode"]
) -> None:
    asset = read_asset("mesh.glb", with_beyond(make(cube_gltf()), b"BEYOND!!"))

    written = asset.patched(moved(asset), WritePolicy(draco=how, meshopt=how))

    document, binary = chunks(written)
    assert binary[document["buffers"][0]["byteLength"] :].strip(b"\0") == b"BEYOND!!"


def test_padding_of_a_chunk_does_not_grow() -> None:
    gltf = one_accessor_for_two()
    gltf.binary += b"\1"
    asset = read_asset("mesh.glb", gltf.glb())

    document, binary = chunks(asset.patched(moved(asset), AUTO))

    assert len(binary) - document["buffers"][0]["byteLength"] < 4


def test_bytes_behind_the_buffer_of_a_file_stay_behind_it() -> None:
    gltf = one_accessor_for_two()
    files = {"a.bin": bytes(gltf.binary) + b"BEYOND!!"}
    asset = read_asset("mesh.gltf", gltf.separate("a.bin"), files)

    written = asset.patched(moved(asset), AUTO)

    (buffer,) = json.loads(written)["buffers"]
    held = base64.b64decode(buffer["uri"].partition(",")[2])
    assert held[buffer["byteLength"] :] == b"BEYOND!!"
