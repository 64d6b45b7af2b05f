"""Polygons of mesh files, decoded without the engine's own readers.

Plain and slow, for files that are known to be valid: what a reader made of a file is compared
with this. glTF and OBJ are decoded here, PLY, STL and OFF by trimesh.
"""

from __future__ import annotations

import base64
import io
import itertools
import json
import struct
from collections.abc import Iterator, Mapping
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

Polygon = NDArray[np.float64]

_FORMATS = {5120: "b", 5121: "B", 5122: "h", 5123: "H", 5125: "I", 5126: "f"}
_LARGEST = {"b": 127.0, "B": 255.0, "h": 32767.0, "H": 65535.0}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_DRACO = "KHR_draco_mesh_compression"


class UndecodedError(Exception):
    """The file is in a form this decoder does not know."""


def decode(kind: str, data: bytes, resources: Mapping[str, bytes]) -> list[Polygon]:
    """(n, 3) corners of every polygon, in world space.

    Args:
        kind: obj, glb, gltf, ply, stl or off.
        data: the file.
        resources: the files a glTF names.

    Raises:
        UndecodedError: the file's form is not known here.
    """
    if kind == "obj":
        return list(_obj_polygons(data.decode("latin-1")))
    if kind in ("glb", "gltf"):
        return list(_Gltf(*_document(kind, data), resources).polygons())
    import trimesh

    mesh = trimesh.load_mesh(io.BytesIO(data), file_type=kind, process=False)
    return list(np.asarray(mesh.vertices, dtype=np.float64)[mesh.faces])


def _obj_polygons(text: str) -> Iterator[Polygon]:
    text = text.replace("\r\n", "\n").replace("\r", "\n").removeprefix("\xef\xbb\xbf")
    statements = [line.partition("#")[0].split() for line in _joined(text.split("\n"))]
    stated = [words for words in statements if words and words[0] in ("v", "f")]
    points = [tuple(map(float, words[1:4])) for words in stated if words[0] == "v"]
    before = 0
    for words in stated:
        if words[0] == "v":
            before += 1
            continue
        indices = [int(word.split("/")[0]) for word in words[1:]]
        yield np.array([points[i - 1 if i > 0 else before + i] for i in indices])


def _joined(lines: list[str]) -> Iterator[str]:
    whole = ""
    for line in lines:
        whole += line
        if line.endswith("\\") and "#" not in line:
            whole = whole[:-1] + " "
            continue
        yield whole
        whole = ""
    yield whole


def _document(kind: str, data: bytes) -> tuple[dict[str, Any], bytes]:
    if kind == "gltf":
        return json.loads(data.decode("utf-8-sig")), b""
    (size,) = struct.unpack_from("<I", data, 12)
    binary = b""
    if len(data) > 20 + size + 8:
        length, chunk = struct.unpack_from("<I4s", data, 20 + size)
        binary = data[28 + size : 28 + size + length] if chunk == b"BIN\0" else b""
    return json.loads(data[20 : 20 + size].decode("utf-8-sig")), binary


class _Gltf:
    def __init__(self, json: dict[str, Any], binary: bytes, resources: Mapping[str, bytes]) -> None:
        self._json, self._binary, self._resources = json, binary, resources

    def polygons(self) -> Iterator[Polygon]:
        """Triangles of the default scene, depth first."""
        nodes = self._json.get("nodes", [])
        if scenes := self._json.get("scenes"):
            roots = scenes[self._json.get("scene", 0)].get("nodes", [])
        else:
            below = set(itertools.chain.from_iterable(n.get("children", []) for n in nodes))
            roots = [index for index in range(len(nodes)) if index not in below]
        for root in roots:
            yield from self._below(nodes, root, np.eye(4))

    def _below(self, nodes: list[Any], index: int, parent: Polygon) -> Iterator[Polygon]:
        node = nodes[index]
        world = parent @ _matrix(node)
        if "mesh" in node:
            placed = np.eye(4) if "skin" in node else world
            for primitive in self._json["meshes"][node["mesh"]]["primitives"]:
                yield from self._triangles(primitive, placed)
        for child in node.get("children", []):
            yield from self._below(nodes, child, world)

    def _triangles(self, primitive: dict[str, Any], placed: Polygon) -> Iterator[Polygon]:
        mode = primitive.get("mode", 4)
        if mode < 4 or "POSITION" not in primitive["attributes"]:
            return
        local, order = self._drawn(primitive)
        points = (np.column_stack([local, np.ones(len(local))]) @ placed.T)[:, :3]
        mirrored = np.linalg.det(placed[:3, :3]) < 0
        for a, b, c in _corners(mode, order):
            yield points[[c, b, a] if mirrored else [a, b, c]]

    def _drawn(self, primitive: dict[str, Any]) -> tuple[Polygon, list[int]]:
        draco = primitive.get("extensions", {}).get(_DRACO)
        if draco is not None:
            import DracoPy

            mesh = DracoPy.decode(self._view(draco["bufferView"]))
            accessor = self._json["accessors"][primitive["attributes"]["POSITION"]]
            points = np.asarray(mesh.points, dtype=np.float64)
            return _dequantized(accessor, points), np.ravel(mesh.faces).tolist()
        points = self._accessor(primitive["attributes"]["POSITION"])
        if "indices" not in primitive:
            return points, list(range(len(points)))
        return points, self._accessor(primitive["indices"])[:, 0].astype(int).tolist()

    def _accessor(self, index: int) -> Polygon:
        accessor = self._json["accessors"][index]
        code, width = _FORMATS[accessor["componentType"]], _WIDTHS[accessor["type"]]
        values = np.zeros((accessor["count"], width))
        if "bufferView" in accessor:
            values = self._elements(accessor, accessor["count"], code, width)
        if sparse := accessor.get("sparse"):
            indices = _FORMATS[sparse["indices"]["componentType"]]
            rows = self._elements(sparse["indices"], sparse["count"], indices, 1)
            new = self._elements(sparse["values"], sparse["count"], code, width)
            values[rows[:, 0].astype(int)] = new
        return _dequantized(accessor, values)

    def _elements(self, place: dict[str, Any], count: int, code: str, width: int) -> Polygon:
        view = self._json["bufferViews"][place["bufferView"]]
        data = self._view(place["bufferView"])
        layout = struct.Struct(f"<{width}{code}")
        stride = view.get("byteStride", layout.size)
        start = place.get("byteOffset", 0)
        rows = [layout.unpack_from(data, start + stride * row) for row in range(count)]
        return np.array(rows, dtype=np.float64)

    def _view(self, index: int) -> bytes:
        view = self._json["bufferViews"][index]
        if any("meshopt" in name for name in view.get("extensions", {})):
            raise UndecodedError("meshopt")
        start = view.get("byteOffset", 0)
        return self._buffer(view["buffer"])[start : start + view["byteLength"]]

    def _buffer(self, index: int) -> bytes:
        uri = self._json["buffers"][index].get("uri")
        if uri is None:
            return self._binary
        if uri.startswith("data:"):
            return base64.b64decode(unquote(uri.partition(",")[2]))
        return self._resources[unquote(uri).removeprefix("./")]


def _dequantized(accessor: dict[str, Any], values: Polygon) -> Polygon:
    if not accessor.get("normalized"):
        return values
    return np.maximum(values / _LARGEST[_FORMATS[accessor["componentType"]]], -1.0)


def _corners(mode: int, order: list[int]) -> Iterator[tuple[int, int, int]]:
    for number in range(len(order) - 2):
        if mode == 4 and number % 3 == 0:
            yield order[number], order[number + 1], order[number + 2]
        elif mode == 5:
            odd = number % 2
            yield order[number], order[number + 1 + odd], order[number + 2 - odd]
        elif mode == 6:
            yield order[number + 1], order[number + 2], order[0]


def _matrix(node: dict[str, Any]) -> Polygon:
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    x, y, z, w = node.get("rotation", (0.0, 0.0, 0.0, 1.0))
    turn = np.array([[w, -z, y, x], [z, w, -x, y], [-y, x, w, z], [-x, -y, -z, w]])
    back = np.array([[w, -z, y, -x], [z, w, -x, -y], [-y, x, w, -z], [x, y, z, w]])
    matrix = (turn @ back) / (x * x + y * y + z * z + w * w)
    matrix[:3, :3] *= node.get("scale", (1.0, 1.0, 1.0))
    matrix[:3, 3] = node.get("translation", (0.0, 0.0, 0.0))
    return matrix
