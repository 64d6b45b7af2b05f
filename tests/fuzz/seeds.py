"""Small valid files of every format and form, to be damaged."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.unit.assets.builders import CUBE, Gltf, cube_gltf, cube_obj, flat_gltf

TETRAHEDRON: NDArray[np.float32] = CUBE[[0, 1, 2, 4]].astype(np.float32)
TRIANGLES = [(0, 1, 2), (0, 2, 3), (0, 3, 1), (1, 3, 2)]

OBJ = [
    cube_obj(),
    b"\xef\xbb\xbfo a\r\nv 0 0 0\r\nv 1e0 0 0\r\nv 0 +1. -0\r\nvn 0 0 1\r\ng \xff b\r\n"
    b"f -3//-1 -2//1 \\\r\n-1//-1 # c\r\nl 1 2\r\nv 1 1 1 .5 .5 .5\r\nf 1 2 4\r\nf 2/ 3 4",
]


def sparse_gltf() -> Gltf:
    """A triangle strip, partly sparse, under a turned node, with a morph target."""
    gltf = flat_gltf(TETRAHEDRON, mode=5)
    gltf.json["accessors"][0]["sparse"] = {
        "count": 1,
        "indices": {"bufferView": gltf.view(b"\2\0"), "componentType": 5123},
        "values": {"bufferView": gltf.view(struct.pack("<3f", 0, 9, 0))},
    }
    target = gltf.accessor(np.ones_like(TETRAHEDRON))
    gltf.json["meshes"][0]["primitives"][0]["targets"] = [{"POSITION": target}]
    gltf.node(children=[0], rotation=[0, 0, 0.6, 0.8], translation=[1, 2, 3])
    gltf.json["scenes"][0]["nodes"] = [1]
    return gltf


def interleaved_gltf() -> Gltf:
    """Quantized positions and normals in one view, and a matrix that mirrors."""
    gltf = Gltf()
    rows = np.zeros(4, dtype=[("position", "<i2", 4), ("normal", "i1", 4)])
    rows["position"][:, :3], rows["normal"][:, 2] = TETRAHEDRON * 100, 127
    view = gltf.view(rows.tobytes(), stride=12)
    position = gltf.accessor(rows["position"][:, :3], view)
    normal = gltf.accessor(rows["normal"][:, :3], view, offset=8, normalized=True)
    indices = gltf.accessor(np.array(TRIANGLES, dtype=np.uint8).reshape(-1))
    primitive: dict[str, Any] = {"attributes": {"POSITION": position, "NORMAL": normal}}
    mesh = gltf.mesh(primitive | {"indices": indices})
    gltf.node(mesh=mesh, matrix=[-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 6, 7, 1])
    gltf.json["extensionsRequired"] = gltf.json["extensionsUsed"] = ["KHR_mesh_quantization"]
    return gltf


def ply(encoding: str = "ascii") -> bytes:
    """A tetrahedron with colours, comments and an element nobody asked for."""
    header = (
        f"ply\nformat {encoding} 1.0\ncomment c\nelement vertex 4\nproperty float x\n"
        "property float y\nproperty float z\nproperty uchar red\nelement face 4\n"
        "property list uchar int vertex_indices\nelement edge 1\nproperty int vertex1\nend_header\n"
    ).encode()
    if encoding == "ascii":
        rows = [f"{x:g} {y:g} {z:g} 255" for x, y, z in TETRAHEDRON]
        rows += [f"3 {a} {b} {c}" for a, b, c in TRIANGLES] + ["0"]
        return header + "\n".join(rows).encode()
    order = "<" if encoding == "binary_little_endian" else ">"
    body = b"".join(struct.pack(f"{order}3fB", *row, 255) for row in TETRAHEDRON)
    body += b"".join(struct.pack(f"{order}B3i", 3, *corners) for corners in TRIANGLES)
    return header + body + struct.pack(f"{order}i", 0)


def mixed_ply() -> bytes:
    """A binary PLY of a quad and two triangles."""
    header = ply("binary_little_endian").partition(b"element face")[0]
    header = header.replace(b"property uchar red\n", b"")
    header += b"element face 3\nproperty list uint ushort vertex_index\nend_header\n"
    faces = [(0, 1, 3, 2), (0, 1, 2), (1, 2, 3)]
    body = b"".join(struct.pack(f"<I{len(face)}H", len(face), *face) for face in faces)
    return header + TETRAHEDRON.tobytes() + body


def binary_stl() -> bytes:
    """A tetrahedron."""
    rows = [struct.pack("<12fH", 0, 0, 0, *TETRAHEDRON[list(t)].ravel(), 0) for t in TRIANGLES]
    return b"solid, not ASCII".ljust(80) + struct.pack("<I", len(rows)) + b"".join(rows)


def ascii_stl() -> bytes:
    """A tetrahedron in two solids."""
    solids = []
    for triangles in (TRIANGLES[:2], TRIANGLES[2:]):
        facets = [
            "\n".join(
                [
                    "facet normal 0 0 1",
                    "outer loop",
                    *(f"vertex {x:g} {y:e} {z:f}" for x, y, z in TETRAHEDRON[list(triangle)]),
                    "endloop",
                    "endfacet",
                ]
            )
            for triangle in triangles
        ]
        solids.append("\n".join(["solid a b", *facets, "endsolid a b"]))
    return "\n".join(solids).encode()


def off(keyword: str = "OFF\n") -> bytes:
    """A tetrahedron with colours on its faces."""
    rows = [f"{x:g} {y:g} {z:g}" for x, y, z in TETRAHEDRON]
    rows += [f"3 {a} {b} {c} 255 0 0" for a, b, c in TRIANGLES]
    return (f"{keyword}4 4 6 # counts\n\n" + "\n".join(rows)).encode()


def textured_gltf() -> Gltf:
    """The cube of the other tests, in two primitives, with all there can be around it."""
    gltf = cube_gltf(name="cube", extras={"a": [1, {"b": None}]})
    primitive = gltf.json["meshes"][0]["primitives"][0]
    gltf.json["meshes"][0]["primitives"].append(primitive | {"material": 0, "mode": 5})
    gltf.json["materials"] = [{"name": "steel", "extensions": {"KHR_materials_unlit": {}}}]
    gltf.json["extensionsUsed"] = ["KHR_materials_unlit"]
    gltf.json["images"] = [{"bufferView": gltf.view(b"not a PNG"), "mimeType": "image/png"}]
    return gltf


def posed_gltf() -> Gltf:
    """The cube under two joints and a morph target that is shown, and at two places more."""
    gltf = cube_gltf(skin=0)
    mesh = gltf.json["meshes"][0]
    attributes = mesh["primitives"][0]["attributes"]
    plain = {name: attributes[name] for name in ("POSITION", "NORMAL")}
    attributes["JOINTS_0"] = gltf.accessor(np.tile(np.array([[0, 1, 0, 0]], dtype="u1"), (24, 1)))
    attributes["WEIGHTS_0"] = gltf.accessor(np.full((24, 4), 0.25, dtype="f4"))
    mesh["primitives"][0]["targets"] = [{"POSITION": attributes["NORMAL"]}]
    mesh["weights"] = [0.5]
    binds = np.tile(np.eye(4, dtype="f4").reshape(-1, 4), (2, 1))
    inverses = gltf.accessor(binds)
    gltf.json["accessors"][inverses] |= {"type": "MAT4", "count": 2}
    gltf.json["skins"] = [{"joints": [1, 2], "inverseBindMatrices": inverses}]
    gltf.node(children=[2], scale=[2, 2, 2])
    gltf.node(root=False, translation=[1, 0, 0])
    indices = mesh["primitives"][0]["indices"]
    copies = {"TRANSLATION": gltf.accessor(np.array([[5, 0, 0], [0, 5, 0]], dtype="f4"))}
    gltf.node(
        mesh=gltf.mesh({"attributes": plain, "indices": indices}),
        extensions={"EXT_mesh_gpu_instancing": {"attributes": copies}},
    )
    gltf.json["extensionsUsed"] = ["EXT_mesh_gpu_instancing"]
    return gltf


def packed(document: Any, binary: bytes, kinds: tuple[bytes, bytes] = (b"JSON", b"BIN\0")) -> bytes:
    """A GLB of any JSON and buffer."""
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<I", len(text)) + kinds[0] + text
    body += struct.pack("<I", len(binary)) + kinds[1] + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


DOCUMENTS = [textured_gltf(), sparse_gltf(), interleaved_gltf(), posed_gltf()]
for gltf in DOCUMENTS:
    gltf.json["buffers"][0]["byteLength"] = len(gltf.binary)
PLY = [ply(), ply("binary_little_endian"), ply("binary_big_endian"), mixed_ply()]
STL = [binary_stl(), ascii_stl()]
OFF = [off(), off("COFF "), off("# first\nSTOFF\n")]
