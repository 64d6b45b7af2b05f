"""Whatever a glTF holds, only positions, normals, tangents and their bounds change."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from meshcone.assets import read_asset
from tests.unit.assets.builders import Gltf, chunks
from tests.unit.assets.random_gltf import containers, gltf_documents, texts

MIN_MAX = ("min", "max")
WRITTEN = ("POSITION", "NORMAL", "TANGENT")
SIZES = {"VEC3": 12, "VEC4": 16}


def differences(one: Any, other: Any, path: str = "") -> Iterator[str]:
    """Where two documents differ, as JSON pointers."""
    if type(one) is not type(other):
        yield path
    elif isinstance(one, dict) and list(one) == list(other):
        for key in one:
            yield from differences(one[key], other[key], f"{path}/{key}")
    elif isinstance(one, list) and len(one) == len(other):
        for number, (item, its_other) in enumerate(zip(one, other, strict=True)):
            yield from differences(item, its_other, f"{path}/{number}")
    elif one != other:
        yield path


def written_accessors(document: dict[str, Any]) -> set[int]:
    primitives = [p for mesh in document["meshes"] for p in mesh["primitives"]]
    return {
        p["attributes"][name] for p in primitives for name in WRITTEN if name in p["attributes"]
    }


def written_bytes(document: dict[str, Any], size: int) -> NDArray[np.bool_]:
    """Which bytes of the buffer hold what may change."""
    mask = np.zeros(size, dtype=bool)

    def mark(place: dict[str, Any], count: int, width: int) -> None:
        view = document["bufferViews"][place["bufferView"]]
        start = view.get("byteOffset", 0) + place.get("byteOffset", 0)
        for row in range(count):
            first = start + row * view.get("byteStride", width)
            mask[first : first + width] = True

    for index in written_accessors(document):
        accessor = document["accessors"][index]
        width = SIZES[accessor["type"]]
        mark(accessor, accessor["count"], width)
        if sparse := accessor.get("sparse"):
            mark(sparse["values"], sparse["count"], width)
    return mask


def without_numbers(text: bytes) -> bytes:
    """The text without bounds and data."""
    text = re.sub(rb'("(?:min|max)"\s*:\s*)\[[^\]]*\]', rb"\1[]", text)
    return re.sub(rb'base64,[^"]*', b"base64,", text)


def refined(name: str, data: bytes) -> bytes:
    """The file with its vertices elsewhere, after a look at where they are."""
    asset = read_asset(name, data)
    moved = asset.vertices + np.sin(3 * asset.vertices[:, ::-1]) / 8
    written = asset.patched(moved)
    again = read_asset(name, written)
    assert np.abs(again.positions - moved[asset.weld])[asset.weld >= 0].max() < 1e-5
    assert np.array_equal(again.faces, asset.faces)
    return written


@given(gltf_documents().flatmap(lambda gltf: st.one_of(texts(gltf), containers(gltf))))
def test_unmoved_it_is_the_same_file(data: bytes) -> None:
    asset = read_asset("mesh", data)
    assert asset.patched(asset.vertices) == data


@given(st.data())
def test_moved_a_glb_differs_in_what_moved_alone(drawn: st.DataObject) -> None:
    gltf: Gltf = drawn.draw(gltf_documents())
    data = drawn.draw(containers(gltf))
    written = refined("mesh.glb", data)
    before, after = chunks(data), chunks(written)
    allowed = {f"/accessors/{n}/{key}" for n in written_accessors(gltf.json) for key in MIN_MAX}
    assert {path.rpartition("/")[0] for path in differences(before[0], after[0])} <= allowed
    buffers = (np.frombuffer(binary, np.uint8) for _, binary in (before, after))
    changed = np.not_equal(*buffers)
    assert not (changed[: len(gltf.binary)] & ~written_bytes(gltf.json, len(gltf.binary))).any()
    assert not changed[len(gltf.binary) :].any()


@given(st.data())
def test_moved_a_gltf_keeps_every_other_character(drawn: st.DataObject) -> None:
    gltf: Gltf = drawn.draw(gltf_documents())
    data = drawn.draw(texts(gltf))
    written = refined("mesh.gltf", data)
    before, after = (json.loads(text.decode("utf-8-sig")) for text in (data, written))
    allowed = {f"/accessors/{n}/{key}" for n in written_accessors(gltf.json) for key in MIN_MAX}
    holders = {path.rpartition("/")[0] for path in differences(before, after)}
    assert holders <= allowed | {"/buffers/0"}
    assert without_numbers(written) == without_numbers(data)
