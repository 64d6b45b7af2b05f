"""Draco data that are damaged, too large or declare what is not there."""

from __future__ import annotations

import json
import struct

import pytest

from meshcone.assets import Limits, read_asset
from meshcone.assets.gltf.decoding import process
from meshcone.assets.gltf.draco.decoder import DracoData, decode_draco
from meshcone.errors import InputError, InternalError, LimitError
from tests.unit.assets.builders import DRACO, Gltf
from tests.unit.assets.test_gltf_draco import cube, read


def extension(gltf: Gltf) -> dict:
    return gltf.json["meshes"][0]["primitives"][0]["extensions"][DRACO]


def make_sparse(gltf: Gltf) -> None:
    gltf.json["accessors"][0]["sparse"] = {
        "count": 1,
        "indices": {"bufferView": gltf.view(b"\2\0"), "componentType": 5123},
        "values": {"bufferView": gltf.view(bytes(12))},
    }


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda g: extension(g).pop("bufferView"), "needs bufferView"),
        (lambda g: extension(g)["attributes"].pop("POSITION"), "without POSITION"),
        (lambda g: extension(g)["attributes"].update(COLOR_0=9), "'COLOR_0', which the primitive"),
        (lambda g: extension(g)["attributes"].update(NORMAL=77), "no attribute 77"),
        (lambda g: g.json["meshes"][0]["primitives"][0].update(mode=5), "lists of triangles"),
        (lambda g: g.json["accessors"][3].update(count=33), "12 triangles, the accessor 11"),
        (lambda g: g.json["accessors"][1].update(count=23), "23 of NORMAL for 24"),
        (
            lambda g: g.json["accessors"][2].update(type="VEC3"),
            "3 components of an element, the Draco data hold 2",
        ),
        (make_sparse, "not supported together with"),
        (lambda g: g.json["bufferViews"][4].update(byteLength=9), "cut short"),
        (lambda g: g.json["bufferViews"][4].update(byteLength=60), "damaged"),
        (lambda g: g.json["bufferViews"][4].update(byteOffset=0), "not a Draco mesh"),
    ],
)
def test_damage_is_refused_with_its_place(damage, message):
    gltf = cube()
    damage(gltf)
    with pytest.raises(InputError, match=message) as caught:
        read(gltf.glb())
    assert caught.value.place.startswith(("/meshes/0", "/accessors"))
    assert caught.value.file == "mesh.glb"


def test_what_it_decompresses_to_counts_against_the_limits():
    for limits in (Limits(vertices=20), Limits(faces=10)):
        with pytest.raises(LimitError):
            read_asset("mesh.glb", cube().glb(), limits=limits)


def bitstream(triangles: int = 12, vertices: int = 24, method: int = 0) -> bytes:
    head = struct.pack("<5sBBBBH", b"DRACO", 2, 2, 1, method, 0)
    return head + bytes(method) + varint(triangles) + varint(vertices) + b"\1" * 40


def varint(value: int) -> bytes:
    digits = []
    while value >= 0x80:
        digits.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*digits, value])


def test_a_bitstream_that_declares_billions_is_refused_before_it_is_decoded(monkeypatch):
    monkeypatch.setattr(process, "_CHILD", "there is no such file")
    for data in (bitstream(triangles=2**31), bitstream(vertices=2**31)):
        with pytest.raises(InputError, match="the Draco data declare 2,147,483,648"):
            decode_draco([DracoData(data, 12, 24, 1000, "/here")])


@pytest.mark.parametrize(
    ("program", "error", "message"),
    [
        ("import os; os.abort()", InputError, "make the decoder crash"),
        ("import sys; sys.exit(4)", LimitError, "more memory"),
        ("import nothing_of_this_name", InternalError, "cannot be run"),
        ("import time; time.sleep(60)", LimitError, "to decode"),
    ],
)
def test_the_decoders_end_is_an_error_and_not_ours(tmp_path, monkeypatch, program, error, message):
    child = tmp_path / "child.py"
    child.write_text(program)
    monkeypatch.setattr(process, "_CHILD", child)
    if "sleep" in program:
        monkeypatch.setattr(process, "_BASE_SECONDS", 1)
    with pytest.raises(error, match=message) as caught:
        decode_draco([DracoData(bitstream(), 12, 24, 1000, "/here")])
    assert caught.value.place == "/here"


def test_a_name_written_with_escapes_is_no_way_around():
    text = json.dumps(cube().json).replace("KHR_draco", "KHR\\u005fdraco").encode()
    with pytest.raises(InputError):
        read_asset("mesh.gltf", text)
