"""Documents that the specification does not allow, or hardly, and every viewer shows."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
import pytest

from meshcone.assets import Asset, WritePolicy, read_asset
from meshcone.errors import InputError
from meshcone.notices import Code
from tests.unit.assets.builders import Gltf, chunks, compress, cube_gltf, split_cube


def read(gltf: Gltf) -> Asset:
    return read_asset("mesh.glb", gltf.glb())


def with_second(**node: Any) -> Gltf:
    """A cube, and another mesh of the same triangles at a node of its own."""
    gltf = cube_gltf()
    positions, _, triangles = split_cube()
    attributes = {"POSITION": gltf.accessor(positions * 2)}
    indices = gltf.accessor(triangles.reshape(-1))
    mesh = gltf.mesh({"attributes": attributes, "indices": indices}, name="Other")
    gltf.node(mesh=mesh, name="Second", **node)
    return gltf


def warned(asset: Asset, code: Code, *words: str) -> bool:
    return any(
        notice.code == code and all(word in notice.words for word in words)
        for notice in asset.warnings
    )


def moved(asset: Asset) -> Asset:
    """The asset read again after every vertex moved."""
    return read_asset("mesh.glb", asset.patched(asset.vertices * 1.5 + 1))


@pytest.mark.parametrize("what", ["vertices", "indices"])
def test_a_primitive_of_nothing_draws_nothing(what: str) -> None:
    gltf = cube_gltf()
    kind = {"type": "VEC3"} if what == "vertices" else {"type": "SCALAR", "componentType": 5125}
    gltf.json["accessors"].append({"componentType": 5126, "count": 0} | kind)
    nothing: dict[str, Any] = {"attributes": {"POSITION": 4 if what == "vertices" else 0}}
    if what == "indices":
        nothing["indices"] = 4
    gltf.json["meshes"][0]["primitives"].append(nothing)

    asset = read(gltf)

    assert asset.counts().faces == 12
    assert warned(asset, Code.PRIMITIVES_EMPTY, "primitive 1 of mesh 0 is without vertices")
    assert np.allclose(moved(asset).vertices, asset.vertices * 1.5 + 1)


def test_indices_left_over_are_not_drawn() -> None:
    gltf = cube_gltf()
    gltf.json["accessors"][3]["count"] = 35

    asset = read(gltf)

    assert asset.counts().faces == 11
    assert warned(asset, Code.INDICES_LEFT_OVER, "primitive 0 of mesh 0 is with")


def test_a_mesh_without_primitives_draws_nothing() -> None:
    gltf = cube_gltf()
    gltf.node(mesh=gltf.mesh(name="Empty"))

    asset = read(gltf)

    assert asset.counts().faces == 12
    assert warned(asset, Code.MESHES_EMPTY, "mesh 'Empty'")


def test_vertices_that_no_triangle_uses_need_no_coordinates() -> None:
    gltf = Gltf()
    positions, _, triangles = split_cube()
    stray = np.concatenate([positions, [[np.nan, np.inf, np.nan]]]).astype(np.float32)
    bounds = {"min": [0.0] * 3, "max": [1.0] * 3}
    attributes = {"POSITION": gltf.accessor(stray, **bounds)}
    indices = gltf.accessor(triangles.reshape(-1))
    gltf.node(mesh=gltf.mesh({"attributes": attributes, "indices": indices}))

    asset = read(gltf)
    written = asset.patched(asset.vertices * 1.5 + 1)

    assert warned(asset, Code.VERTICES_ASTRAY, "without finite coordinates: 1", "not drawn: 0")
    assert np.isfinite(asset.vertices).all()
    document, binary = chunks(written)
    assert document["accessors"][0]["min"] == [1.0] * 3
    assert binary[24 * 12 : 25 * 12] == stray[24:].tobytes()


@pytest.mark.parametrize("nowhere", [np.nan, np.inf])
def test_triangles_with_a_corner_nowhere_are_not_drawn(nowhere: float) -> None:
    gltf = cube_gltf()
    gltf.binary[:4] = np.float32(nowhere).tobytes()

    asset = read(gltf)

    assert asset.counts().faces == 10
    assert warned(asset, Code.VERTICES_ASTRAY, "without finite coordinates: 1", "not drawn: 2")
    again = read_asset("mesh.glb", asset.patched(asset.vertices * 1.5 + 1))
    assert np.allclose(again.vertices, asset.vertices * 1.5 + 1)


def test_a_document_may_be_padded_with_zeros() -> None:
    glb = cube_gltf().glb()
    (length,) = struct.unpack_from("<I", glb, 12)
    padded = bytearray(glb[: 20 + length] + bytes(4) + glb[20 + length :])
    struct.pack_into("<I", padded, 8, len(padded))
    struct.pack_into("<I", padded, 12, length + 4)

    asset = read_asset("mesh.glb", bytes(padded))
    written = asset.patched(asset.vertices[:, [1, 0, 2]])

    assert asset.counts().faces == 12
    assert written[12 : 24 + length] == bytes(padded[12 : 24 + length])


@pytest.mark.parametrize(
    ("node", "code"),
    [
        ({"scale": [0, 0, 0]}, Code.NODES_FLATTENED),
        ({"scale": [2, 0, 0]}, Code.NODES_FLATTENED),
        ({"extensions": {"KHR_node_visibility": {"visible": False}}}, Code.NODES_INVISIBLE),
    ],
)
def test_what_no_viewer_shows_is_left_as_it_is(node: dict[str, Any], code: Code) -> None:
    gltf = with_second(**node)
    hidden = gltf.json["accessors"][4]["bufferView"]
    start = gltf.json["bufferViews"][hidden]["byteOffset"]

    asset = read(gltf)
    _, before = chunks(gltf.glb())
    _, after = chunks(asset.patched(asset.vertices + 1))

    assert asset.counts().faces == 12
    assert warned(asset, code, "node 'Second'")
    assert after[start : start + 288] == before[start : start + 288]
    assert after != before


def test_what_is_below_a_node_that_is_switched_off_is_not_shown_either() -> None:
    gltf = with_second()
    gltf.node(children=[1], extensions={"KHR_node_visibility": {"visible": False}})
    gltf.json["scenes"][0]["nodes"] = [0, 2]
    assert read(gltf).counts().faces == 12


def test_a_node_may_say_that_it_is_shown() -> None:
    gltf = with_second(extensions={"KHR_node_visibility": {"visible": True}})
    assert read(gltf).counts().faces == 24


def test_of_levels_of_detail_the_nearest_is_read() -> None:
    gltf = with_second()
    gltf.json["nodes"][0]["extensions"] = {"MSFT_lod": {"ids": [1]}}

    asset = read(gltf)

    assert asset.counts().faces == 12
    assert warned(asset, Code.NODES_LEVEL, "node 'Second'")


def test_coordinates_may_be_relative_to_a_center() -> None:
    center = np.array([1e6, -2e6, 3e6])
    gltf = cube_gltf(rotation=[0, 0.6, 0, 0.8])
    there = read(gltf)
    gltf.json["extensions"] = {"CESIUM_RTC": {"center": center.tolist()}}
    gltf.json["extensionsUsed"] = gltf.json["extensionsRequired"] = ["CESIUM_RTC"]

    asset = read(gltf)

    assert np.allclose(asset.vertices, there.vertices + center, rtol=0, atol=1e-9)
    assert warned(asset, Code.SCENE_RELATIVE, "1,000,000, -2,000,000, 3,000,000")
    assert np.allclose(
        read_asset("mesh.glb", asset.patched(asset.vertices + 1)).vertices,
        asset.vertices + 1,
        rtol=0,
        atol=1e-6,
    )


@pytest.mark.parametrize(
    "name",
    ["EXT_mesh_features", "EXT_structural_metadata", "VRMC_vrm", "VRM", "KHR_node_visibility"],
)
def test_a_required_extension_that_moves_no_vertex_is_no_obstacle(name: str) -> None:
    gltf = cube_gltf()
    gltf.json["extensionsRequired"] = [name]
    gltf.json["meshes"][0]["primitives"][0]["extensions"] = {name: {}}
    asset = read(gltf)
    assert asset.warnings == ()
    assert len(moved(asset).faces) == 12


def test_an_unknown_required_extension_is_warned_of() -> None:
    gltf = cube_gltf(extensions={"ACME_gizmo": {}})
    gltf.json["extensionsRequired"] = ["ACME_gizmo"]
    asset = read(gltf)
    assert warned(asset, Code.EXTENSIONS_UNKNOWN, "'ACME_gizmo'")
    assert len(moved(asset).faces) == 12


@pytest.mark.parametrize("place", ["/meshes/0/primitives/0", "/accessors/2", "/bufferViews/1"])
def test_what_an_unknown_extension_says_of_vertex_data_is_not_contradicted(place: str) -> None:
    gltf = cube_gltf()
    target: Any = gltf.json
    for key in place.strip("/").split("/"):
        target = target[int(key) if key.isdigit() else key]
    target["extensions"] = {"ACME_squeeze": {}}
    gltf.json["extensionsRequired"] = ["ACME_squeeze"]

    asset = read(gltf)

    with pytest.raises(InputError, match=r"'ACME_squeeze'.* measured, not refined") as caught:
        asset.ensure_writable(WritePolicy())
    assert caught.value.place == f"{place}/extensions"


@pytest.mark.parametrize(
    ("uri", "sent"),
    [
        ("./data/Box.bin", "data/Box.bin"),
        ("data\\Box%200.bin", "data/Box 0.bin"),
        ("data/../Box.bin", "Box.bin"),
        ("data//./Box.bin", "data/Box.bin"),
        ("data/Box.bin", "model/data/Box.bin"),
    ],
)
def test_a_buffer_may_be_in_a_folder(uri: str, sent: str) -> None:
    gltf = cube_gltf()
    asset = read_asset("mesh.gltf", gltf.separate(uri), {sent: bytes(gltf.binary)})
    assert asset.counts().faces == 12


def test_sets_of_texture_coordinates_may_share_an_accessor_under_draco() -> None:
    gltf = cube_gltf()
    attributes = gltf.json["meshes"][0]["primitives"][0]["attributes"]
    attributes["TEXCOORD_1"] = attributes["TEXCOORD_0"]

    asset = read(compress(gltf))

    assert asset.counts().faces == 12
    for policy in (WritePolicy(), WritePolicy(draco="encode")):
        again = read_asset("mesh.glb", asset.patched(asset.vertices + 1, policy))
        assert np.allclose(again.vertices, asset.vertices + 1, atol=1e-4)


def test_the_version_may_be_a_number() -> None:
    gltf = cube_gltf()
    gltf.json["asset"]["version"] = 2

    assert read(gltf).counts().faces == 12


def data_uri(head: str, body: str) -> bytes:
    """A cube whose buffer is a data URI with this head; the body is given its base64."""
    plain = json.loads(cube_gltf().embedded())
    [buffer] = plain["buffers"]
    coded = buffer["uri"].partition(",")[2]
    buffer["uri"] = f"data:{head},{body.format(coded, coded.rstrip('='))}"
    return json.dumps(plain).encode()


@pytest.mark.parametrize(
    ("head", "body"),
    [
        ("model/x; base64", "{0}"),
        ("model/x;BASE64", "{0}"),
        ("model/x;base64", " {0}\n"),
        ("model/x;base64", "%20{0}"),
        (";base64", "{1}"),
    ],
)
def test_a_data_uri_is_read_as_browsers_read_it(head: str, body: str) -> None:
    expected = read_asset("a.gltf", cube_gltf().embedded())

    asset = read_asset("a.gltf", data_uri(head, body))

    np.testing.assert_array_equal(asset.vertices, expected.vertices)


@pytest.mark.parametrize("head", ["model/x;base64 ", "base64"])
def test_a_data_uri_that_says_base64_elsewhere_is_refused(head: str) -> None:
    with pytest.raises(InputError, match="base64"):
        read_asset("a.gltf", data_uri(head, "{0}"))
