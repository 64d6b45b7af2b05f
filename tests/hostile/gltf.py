"""glTF documents whose parts do not fit together."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import numpy as np

from tests.hostile.case import Case
from tests.unit.assets.builders import Gltf, cube_gltf, flat_gltf

Change = Callable[[Gltf], object]

_HUGE = 10**4299  # the longest number Python's JSON reader takes


def _made(change: Change) -> Callable[[], bytes]:
    def make() -> bytes:
        gltf = cube_gltf()
        change(gltf)
        return gltf.glb()

    return make


def _setting(path: str, value: Any) -> Change:
    """Put a value at a JSON pointer."""
    *parents, key = path.strip("/").split("/")

    def change(gltf: Gltf) -> None:
        target = gltf.json
        for parent in parents:
            target = target[int(parent) if parent.isdigit() else parent]
        if isinstance(target, list):
            target[int(key)] = value
        else:
            target[key] = value

    return change


def _at(path: str, value: Any, place: str | None, message: str) -> Case:
    """A value that is wrong where it stands; the title is the place and what stands there."""
    title = f"{path} is {json.dumps(value)}" if value != _HUGE else f"{path} has 4,300 digits"
    place = path if place == "" else place
    return Case(title, "mesh.glb", _made(_setting(path, value)), "input", place, message)


def _input(title: str, change: Change, place: str | None, message: str) -> Case:
    return Case(title, "mesh.glb", _made(change), "input", place, message)


def _limit(title: str, change: Change, place: str, message: str, **limits: int) -> Case:
    return Case(title, "mesh.glb", _made(change), "limit", place, message, limits=limits)


def _uri(uri: str, message: str, resources: dict[str, bytes] | None = None) -> Case:
    return Case(
        f"buffer at {uri[:40]}: {message[:20]}",
        "mesh.gltf",
        lambda: cube_gltf().separate(uri),
        "input",
        "/buffers/0/(uri|byteLength)",
        message,
        resources=resources or {},
    )


def _sparse(stored: int, rows: bytes, kind: int = 5121, **values: Any) -> Change:
    def change(gltf: Gltf) -> None:
        gltf.json["accessors"][0]["sparse"] = {
            "count": stored,
            "indices": {"bufferView": gltf.view(rows), "componentType": kind},
            "values": {"bufferView": gltf.view(bytes(24))} | values,
        }

    return change


def _chain(length: int) -> Change:
    def change(gltf: Gltf) -> None:
        for _ in range(length):
            gltf.node(root=False, children=[len(gltf.json["nodes"]) - 1])
        gltf.json["scenes"][0]["nodes"] = [len(gltf.json["nodes"]) - 1]

    return change


def _instances(count: int) -> Change:
    return lambda gltf: [gltf.node(mesh=0) for _ in range(count)]


def _draws(primitives: int, nodes: int) -> Callable[[], bytes]:
    """Few bytes that draw one triangle a great many times."""

    def make() -> bytes:
        gltf = flat_gltf(np.eye(3, dtype=np.float32))
        gltf.json["meshes"][0]["primitives"] *= primitives
        gltf.json["nodes"] = [{"mesh": 0}] * nodes
        gltf.json["scenes"][0]["nodes"] = list(range(nodes))
        return gltf.glb()

    return make


def _unstored(count: int, copies: int) -> Callable[[], bytes]:
    """Normals of which no byte exists, once for each primitive."""

    def make() -> bytes:
        gltf = flat_gltf(np.eye(3, dtype=np.float32))
        zeros = {"componentType": 5126, "type": "VEC3", "count": count}
        gltf.json["accessors"] = [zeros] * (copies + 1)
        indices = gltf.accessor(np.array([0, 1, 2], dtype=np.uint16))
        gltf.json["meshes"][0]["primitives"] = [
            {"attributes": {"POSITION": 0, "NORMAL": 1 + copy}, "indices": indices}
            for copy in range(copies)
        ]
        return gltf.glb()

    return make


def _nowhere(value: float) -> Change:
    def change(gltf: Gltf) -> None:
        gltf.binary[: 24 * 12] = np.float32(value).tobytes() * 72

    return change


_PRIMITIVE = "/meshes/0/primitives/0"

CASES = [
    _at("/accessors/0/count", 25, "", "25 elements need 300 bytes, .* has 288"),
    _at("/accessors/0/count", 200_000_000, "", "200,000,000 elements need"),
    _at("/accessors/0/count", _HUGE, "", "at most 9,007,199,254,740,991, found a huge number"),
    _at("/accessors/0/count", 1e300, "", "at most 9,007,199,254,740,991, found a huge number"),
    _at("/accessors/0/count", 0, None, "it has no faces"),
    _at("/accessors/0/count", "24", "", "whole number, found a string"),
    _at("/accessors/0/count", 2.5, "", "whole number, found 2.5"),
    _at("/accessors/0/count", True, "", "whole number, found a boolean"),
    _at("/accessors/0/byteOffset", 4, "/accessors/0/count", "need 292 bytes"),
    _at("/accessors/0/byteOffset", -4, "", "at least 0, found -4"),
    _at("/accessors/0/componentType", 5130, "", "unknown component type"),
    _at("/accessors/0/componentType", 5122, "", "must be FLOAT"),
    _at("/accessors/0/type", "VEC2", "", "must be VEC3, found VEC2"),
    _at("/accessors/0/type", "VEC9", "", "unknown accessor type 'VEC9'"),
    _at("/accessors/0/bufferView", 99, "", "names buffer view 99, but there are only 4"),
    _at("/accessors/0/normalized", 1, "", "a boolean, found 1"),
    _at("/accessors/1/count", 23, "", "23 of NORMAL for 24 positions"),
    _at("/accessors/3/count", 2, None, "it has no faces"),
    _at("/accessors/3/componentType", 5126, "/accessors/3/count", "need 144 bytes"),
    _at("/accessors/3/componentType", 5122, "", "unsigned"),
    _at("/accessors/3/type", "VEC2", "/accessors/3/count", "need 144 bytes"),
    _at("/bufferViews/0/byteLength", 10**12, "", "ends at byte 1,000,000,000,000"),
    _at("/bufferViews/0/byteLength", _HUGE, "", "at most"),
    _at("/bufferViews/0/byteOffset", 10**9, "/bufferViews/0/byteLength", "ends at byte"),
    _at("/bufferViews/0/byteStride", 4, "", "4 bytes for elements of 12"),
    _at("/bufferViews/0/byteStride", 252, "/accessors/0/count", "need 5,808 bytes"),
    _at("/bufferViews/0/buffer", 7, "", "names buffer 7, but there are only 1"),
    Case(
        "a buffer longer than its chunk",
        "mesh.glb",
        lambda: cube_gltf().glb().replace(b'[{"byteLength": 840', b'[{"byteLength":9999'),
        "input",
        "/buffers/0/byteLength",
        "declares 9,999 bytes, the buffer has 840",
    ),
    _at("/nodes/0/mesh", 1, "", "names mesh 1, but there are only 1"),
    _at("/nodes/0/mesh", -1, "", "at least 0"),
    _at("/nodes/0/children", [0], "/nodes/0", "reached twice"),
    _at("/nodes/0/children", [9], "/nodes/0/children/0", "names node 9"),
    _at("/nodes/0/children", 0, "", "an array, found 0"),
    _at("/nodes/0/rotation", [0, 0, 0, 0], "", "unit quaternion, found length 0"),
    _at("/nodes/0/scale", [1, 1], "", "3 finite numbers, found an array of 2"),
    _at("/nodes/0/translation", [1, 1, None], "/nodes/0/translation/2", "finite .* found null"),
    _at("/nodes/0/scale", [1, 10**400, 1], "/nodes/0/scale/1", "finite number, found a huge"),
    _at("/nodes/0/matrix", [1] * 16, "", "last row"),
    _at("/nodes/0/scale", [1e200] * 3, "/accessors/0", "not at finite coordinates"),
    _at("/meshes/0/primitives", [], None, "it has no faces"),
    _at(f"{_PRIMITIVE}/mode", 7, "", "unknown primitive mode 7"),
    _at(f"{_PRIMITIVE}/attributes", [], "", "an object, found an array"),
    _at(f"{_PRIMITIVE}/attributes/POSITION", 9, "", "names accessor 9"),
    _at(f"{_PRIMITIVE}/indices", 9, "", "names accessor 9"),
    _at(f"{_PRIMITIVE}/indices", 1, "/accessors/1/componentType", "unsigned scalars"),
    _at("/extensionsRequired", "ACME_gizmo", "", "an array of strings"),
    _at("/scene", 3, "", "names scene 3, but there are only 1"),
    _at("/nodes", [], "/scenes/0/nodes/0", "names node 0"),
    _at("/scenes/0/nodes", [], None, "it has no faces"),
    _input(
        "every node is another's child",
        lambda gltf: gltf.json.update(nodes=[{"children": [1]}, {"children": [0]}], scenes=[]),
        "/nodes",
        "cycle",
    ),
    _input(
        "transforms that overflow on the way down",
        lambda gltf: (
            _chain(3)(gltf),
            [node.update(scale=[1e200] * 3) for node in gltf.json["nodes"]],
        ),
        r"/nodes/\d",
        "overflows",
    ),
    _input("infinite positions", _nowhere(np.inf), None, "it has no faces"),
    _input("positions that are no numbers", _nowhere(np.nan), None, "it has no faces"),
    Case(
        "a signalling NaN",
        "mesh.glb",
        _made(lambda gltf: gltf.binary.__setitem__(slice(0, 4), b"\0\0\xa0\x7f")),
        "ok",
    ),
    _input(
        "an index past the last vertex",
        lambda gltf: gltf.binary.__setitem__(slice(-2, None), b"\x18\0"),
        f"{_PRIMITIVE}/indices",
        "names vertex 24 of only 24",
    ),
    _input("more sparse elements than elements", _sparse(25, bytes(25)), ".*/sparse/count", "25 s"),
    _input("sparse indices that descend", _sparse(2, b"\2\1"), "/accessors/0/sparse", "must asc"),
    _input("a sparse index past the end", _sparse(1, b"\xff"), "/accessors/0/sparse", "below 24"),
    _input("sparse indices that are floats", _sparse(1, bytes(4), 5126), ".*componentType", "unsi"),
    _input(
        "sparse indices that are not there", _sparse(9, bytes(1)), ".*/indices/.*", "9 elements"
    ),
    _input("sparse values that are not there", _sparse(3, b"\0\1\2"), ".*/values/.*", "3 elements"),
    _input(
        "sparse values of a view that is not there",
        _sparse(1, b"\0", bufferView=99),
        "/accessors/0/sparse/values/bufferView",
        "names buffer view 99",
    ),
    _input(
        "a sparse accessor without values",
        _setting("/accessors/0/sparse", {"count": 1, "indices": {}}),
        "/accessors/0/sparse",
        "needs indices and values",
    ),
    _uri("Box0.bin", "'Box0.bin', which was not sent"),
    _uri("/etc/passwd", "not the name of a file sent along"),
    _uri("file:///etc/passwd", "not the name of a file sent along"),
    _uri("https://example.org/Box.bin", "not the name of a file sent along"),
    _uri("C:\\Box.bin", "not the name of a file sent along"),
    _uri("\\\\host\\share\\Box.bin", "not the name of a file sent along"),
    _uri("../Box.bin", "not the name", {"Box.bin": bytes(999)}),
    _uri("%2e%2e%2fBox.bin", "not the name", {"Box.bin": bytes(999)}),
    _uri("sub/%2e%2e/../Box.bin", "not the name", {"Box.bin": bytes(999)}),
    _uri("sub\\..\\..\\Box.bin", "not the name", {"Box.bin": bytes(999)}),
    _uri("%2Fetc%2Fpasswd", "not the name", {"/etc/passwd": bytes(999)}),
    _uri("C%3A%5CBox.bin", "not the name", {"C:\\Box.bin": bytes(999)}),
    _uri("sub/Box.bin", "'sub/Box.bin', which was not sent", {"Box.bin": bytes(999)}),
    _uri("Box.bin", "which was not sent", {"a/Box.bin": bytes(999), "b/Box.bin": bytes(999)}),
    _uri("..", "not the name", {"..": bytes(999)}),
    _uri("", "not the name", {"": bytes(999)}),
    _uri("Box.bin", "Git LFS pointer", {"Box.bin": b"version https://git-lfs.github.com/spec/v1"}),
    _uri("Box.bin", "declares [0-9,]+ bytes, the buffer has 3", {"Box.bin": b"abc"}),
    _uri("data:,ab", "declares [0-9,]+ bytes, the buffer has 2"),
    _uri("data:;base64,!!", "not valid base64"),
    _uri("data:;base64,é", "not valid base64"),
    _uri("data:nothing", "has no comma"),
    _limit("deep node tree", _chain(300), r"/nodes/\d+", "257 levels of nodes; .* accepts 256"),
    _limit("instances", _instances(9), r"/nodes/\d", "vertices in the scene", vertices=100),
    _limit(
        "primitives that share indices",
        lambda gltf: gltf.json["meshes"][0]["primitives"].extend(
            gltf.json["meshes"][0]["primitives"] * 9
        ),
        "/accessors/3/count",
        "triangles",
        faces=100,
    ),
    _limit(
        "primitives",
        lambda gltf: gltf.json["meshes"][0]["primitives"].extend(
            gltf.json["meshes"][0]["primitives"] * 9
        ),
        "/meshes/0/primitives",
        "10 primitives",
        meshes=9,
    ),
    Case(
        "a count no buffer bounds",
        "mesh.glb",
        _unstored(3 * 10**8, 1),
        "limit",
        "/nodes/0",
        "300,000,000 vertices in the scene",
    ),
    Case(
        "a mesh drawn at many nodes",
        "mesh.glb",
        _draws(10, 10),
        "limit",
        r"/nodes/\d",
        "100 primitives drawn|primitives drawn",
        limits={"meshes": 50},
    ),
    Case(
        "a percent-encoded name",
        "mesh.gltf",
        lambda: cube_gltf().separate("./Box%200.bin"),
        "ok",
        resources={"Box 0.bin": bytes(cube_gltf().binary)},
    ),
]

BOMBS = [
    Case(
        "a triangle drawn a million times",
        "mesh.glb",
        _draws(1_000, 1_000),
        "limit",
        r"/nodes/\d+",
        "primitives drawn",
    ),
    Case(
        "a thousand times a million normals without a byte",
        "mesh.glb",
        _unstored(1_000_000, 1_000),
        "limit",
        r"/accessors/\d+",
        "normals in the scene",
    ),
    Case(
        "long names multiplied by each other",
        "mesh.glb",
        _made(
            lambda gltf: (
                gltf.json["nodes"][0].update(name="x" * 1_000_000),
                gltf.json.update(materials=[{}] * 10_000),
                gltf.json["meshes"][0].update(
                    primitives=[
                        gltf.json["meshes"][0]["primitives"][0] | {"material": number}
                        for number in range(10_000)
                    ]
                ),
            )
        ),
        "ok",
    ),
    Case("nodes without end", "mesh.glb", _made(_instances(25_000)), "ok"),
]
