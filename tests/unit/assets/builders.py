"""Meshes and files for the tests, made by hand so that every byte is known."""

from __future__ import annotations

import base64
import json
import struct
from typing import Any

import DracoPy
import numpy as np
from numpy.typing import NDArray

CUBE = np.array([[x, y, z] for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)])
CUBE_QUADS = [
    (0, 2, 3, 1),
    (4, 5, 7, 6),
    (0, 1, 5, 4),
    (2, 6, 7, 3),
    (0, 4, 6, 2),
    (1, 3, 7, 5),
]
CUBE_NORMALS = np.array(
    [[0, 0, -1], [0, 0, 1], [0, -1, 0], [0, 1, 0], [-1, 0, 0], [1, 0, 0]], dtype=float
)

COMPONENT = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
KIND = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}


def split_cube() -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.uint16]]:
    """A cube as renderers store it: (24, 3) positions and normals, split at every edge."""
    positions = np.concatenate([CUBE[list(quad)] for quad in CUBE_QUADS]).astype(np.float32)
    normals = np.repeat(CUBE_NORMALS, 4, axis=0).astype(np.float32)
    triangles = np.concatenate([np.array([[0, 1, 2], [0, 2, 3]]) + 4 * n for n in range(6)])
    return positions, normals, triangles.astype(np.uint16)


def cube_obj() -> bytes:
    """A cube with quads, texture seams, normals, two materials, comments and colours."""
    lines = ["# a cube\r", "mtllib cube.mtl", "o cube"]
    lines += [f"v {x:.6f}  {y:.6f}\t{z:.6f} 0.5 0.25 1  # corner" for x, y, z in CUBE]
    lines += ["vt 0 0", "vt 1 0", "vt 1 1", "vt 0 1"]
    lines += [f"vn {x:g} {y:g} {z:g}" for x, y, z in CUBE_NORMALS]
    for side, quad in enumerate(CUBE_QUADS):
        if side % 3 == 0:
            lines.append(f"usemtl material {side // 3}")
        corners = (f"{vertex + 1}/{uv + 1}/{side + 1}" for uv, vertex in enumerate(quad))
        lines.append("f " + " ".join(corners))
    return "\n".join(lines).encode()


class Gltf:
    """Puts a glTF document together.

    ``json`` is the document; tests change it at will before they ask for bytes.
    """

    def __init__(self) -> None:
        self.binary = bytearray()
        self.json: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": []}],
            "nodes": [],
            "meshes": [],
            "accessors": [],
            "bufferViews": [],
            "buffers": [{"byteLength": 0}],
        }

    def view(self, data: bytes, stride: int | None = None) -> int:
        """Append bytes as a buffer view."""
        self.binary += b"\0" * (-len(self.binary) % 4)
        view = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)}
        if stride:
            view["byteStride"] = stride
        self.binary += data
        self.json["bufferViews"].append(view)
        return len(self.json["bufferViews"]) - 1

    def accessor(
        self, values: NDArray[Any], view: int | None = None, offset: int = 0, **extra: Any
    ) -> int:
        """Declare an accessor, over bytes of its own unless a view is given."""
        table = values.reshape(len(values), -1)
        if view is None:
            view = self.view(np.ascontiguousarray(table).tobytes())
        declared: dict[str, Any] = {
            "bufferView": view,
            "byteOffset": offset,
            "componentType": COMPONENT[table.dtype.str[1:]],
            "count": len(table),
            "type": KIND[table.shape[1]],
            "min": table.min(axis=0).tolist(),
            "max": table.max(axis=0).tolist(),
        }
        self.json["accessors"].append(declared | extra)
        return len(self.json["accessors"]) - 1

    def mesh(self, *primitives: dict[str, Any], **extra: Any) -> int:
        """Add a mesh."""
        self.json["meshes"].append({"primitives": list(primitives)} | extra)
        return len(self.json["meshes"]) - 1

    def node(self, *, root: bool = True, **properties: Any) -> int:
        """Add a node, to the scene unless it will be a child."""
        self.json["nodes"].append(properties)
        index = len(self.json["nodes"]) - 1
        if root:
            self.json["scenes"][0]["nodes"].append(index)
        return index

    def glb(self) -> bytes:
        """The document as one GLB file."""
        self.json["buffers"][0]["byteLength"] = len(self.binary)
        text = json.dumps(self.json).encode()
        text += b" " * (-len(text) % 4)
        payload = bytes(self.binary) + b"\0" * (-len(self.binary) % 4)
        chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
        chunks += struct.pack("<II", len(payload), 0x004E4942) + payload
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks

    def embedded(self) -> bytes:
        """The document with its buffer in a data URI, laid out for people to read."""
        data = base64.b64encode(self.binary).decode()
        buffer = {"byteLength": len(self.binary), "uri": f"data:model/x;base64,{data}"}
        return json.dumps(self.json | {"buffers": [buffer]}, indent=2).encode()

    def separate(self, uri: str) -> bytes:
        """The document naming its buffer, whose bytes are ``self.binary``."""
        buffer = {"byteLength": len(self.binary), "uri": uri}
        return json.dumps(self.json | {"buffers": [buffer]}).encode()


def cube_gltf(**node: Any) -> Gltf:
    """A split cube with normals and texture coordinates, at one node."""
    gltf = Gltf()
    positions, normals, triangles = split_cube()
    uv = np.tile(np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float32), (6, 1))
    attributes = {
        "POSITION": gltf.accessor(positions),
        "NORMAL": gltf.accessor(normals),
        "TEXCOORD_0": gltf.accessor(uv),
    }
    indices = gltf.accessor(triangles.reshape(-1))
    gltf.node(mesh=gltf.mesh({"attributes": attributes, "indices": indices}, name="Cube"), **node)
    return gltf


def flat_gltf(positions: NDArray[Any], triangles: NDArray[Any] | None = None, **mode: Any) -> Gltf:
    """One primitive with positions only."""
    gltf = Gltf()
    primitive: dict[str, Any] = {"attributes": {"POSITION": gltf.accessor(positions)}} | mode
    if triangles is not None:
        primitive["indices"] = gltf.accessor(triangles.astype(np.uint16).reshape(-1))
    gltf.node(mesh=gltf.mesh(primitive))
    return gltf


def chunks(glb: bytes) -> tuple[dict[str, Any], bytes]:
    """Document and binary buffer of a GLB file."""
    (length,) = struct.unpack_from("<I", glb, 12)
    return json.loads(glb[20 : 20 + length]), glb[28 + length :]


DRACO = "KHR_draco_mesh_compression"


def compress(gltf: Gltf, mesh: int = 0, primitive: int = 0, *, keep_copy: bool = False) -> Gltf:
    """Put a primitive whose accessors have views of their own into a Draco bitstream."""
    document = gltf.json
    drawn = document["meshes"][mesh]["primitives"][primitive]
    values = {name: stored(gltf, index) for name, index in drawn["attributes"].items()}
    others = {name: number for number, name in enumerate(values) if name != "POSITION"}
    positions = values["POSITION"]
    data = DracoPy.encode(
        positions if positions.dtype.kind == "f" else positions.astype(np.int32),
        stored(gltf, drawn["indices"]).reshape(-1, 3).astype(np.uint32),
        quantization_bits=20,
        preserve_order=True,
        generic_attributes={number: values[name] for name, number in others.items()} or None,
    )
    first = next(a for a in DracoPy.decode(data).attributes if a["attribute_type"] == 0)
    ids = {name: others.get(name, first["unique_id"]) for name in values}
    if not keep_copy:
        for index in (drawn["indices"], *drawn["attributes"].values()):
            for key in ("bufferView", "byteOffset"):
                document["accessors"][index].pop(key, None)
    drawn["extensions"] = {DRACO: {"bufferView": gltf.view(data), "attributes": ids}}
    document["extensionsUsed"] = [DRACO]
    if not keep_copy:
        document["extensionsRequired"] = [DRACO]
    return gltf


def stored(gltf: Gltf, accessor: int) -> NDArray[Any]:
    """(count, columns) components of an accessor with a view of its own."""
    declared = gltf.json["accessors"][accessor]
    start = gltf.json["bufferViews"][declared["bufferView"]]["byteOffset"]
    kind = next(name for name, code in COMPONENT.items() if code == declared["componentType"])
    columns = next(width for width, name in KIND.items() if name == declared["type"])
    count = declared["count"] * columns
    return np.frombuffer(bytes(gltf.binary), f"<{kind}", count, start).reshape(-1, columns)
