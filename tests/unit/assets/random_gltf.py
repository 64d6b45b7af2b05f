"""glTF files of any layout, with all that a refinement must leave alone."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from tests.unit.assets.builders import CUBE, Gltf, split_cube

Floats = NDArray[np.float32]

_NAMES = st.sampled_from(["a", "", "ä ☃", 'quo"te\\', "x" * 80])
_EXTRAS = st.sampled_from([1, [], {"a": [1.0, 1e-7, {"b": None}]}, "☃"])


@st.composite
def gltf_documents(draw: st.DrawFn) -> Gltf:
    """A document of one to three meshes, each in a place of its own."""
    gltf = Gltf()
    if draw(st.booleans()):
        gltf.view(draw(st.binary(min_size=1, max_size=9)))  # so that nothing starts at 0
    for number in range(draw(st.integers(1, 3))):
        mesh = gltf.mesh(*_primitives(draw, gltf), name=draw(_NAMES))
        child = gltf.node(root=False, mesh=mesh, name=draw(_NAMES), **_transform(draw))
        gltf.node(children=[child], translation=[3.0 * number, 0, 0], extras=draw(_EXTRAS))
    _surroundings(draw, gltf)
    gltf.json = _shuffled(draw, gltf.json)
    return gltf


@st.composite
def texts(draw: st.DrawFn, gltf: Gltf) -> bytes:
    """Its JSON in some hand, with the buffer inside."""
    document = json.loads(gltf.embedded())
    text = json.dumps(
        document,
        indent=draw(st.sampled_from([None, 1, "\t"])),
        ensure_ascii=draw(st.booleans()),
        separators=draw(st.sampled_from([(",", ":"), (", ", ": "), (" ,", " :\n")])),
    )
    return draw(st.sampled_from(["", "\ufeff", " \n"])).encode() + text.encode() + b"\n"


@st.composite
def containers(draw: st.DrawFn, gltf: Gltf) -> bytes:
    """The document as a GLB, with a chunk nobody knows and bytes after the end."""
    glb = gltf.glb()
    if draw(st.booleans()):
        glb += struct.pack("<I4s", 4, b"MORE") + b"more"
        glb = glb[:8] + struct.pack("<I", len(glb)) + glb[12:]
    return glb + draw(st.sampled_from([b"", b"after the end"]))


def _primitives(draw: st.DrawFn, gltf: Gltf) -> list[dict[str, Any]]:
    if draw(st.booleans()):
        positions, normals, triangles = split_cube()
    else:
        positions = CUBE.astype(np.float32)
        normals = (positions - 0.5) / np.float32(np.sqrt(0.75))
        triangles = np.array([[0, 2, 3], [0, 3, 1], [0, 1, 5], [0, 5, 4], [4, 5, 7]])
    columns: dict[str, Floats] = {"POSITION": positions}
    if draw(st.booleans()):
        columns["NORMAL"] = normals
        if draw(st.booleans()):
            across = np.roll(normals, 1, axis=1)
            columns["TANGENT"] = np.column_stack([across, np.ones(len(across))]).astype(np.float32)
    if draw(st.booleans()):
        columns["TEXCOORD_0"] = positions[:, :2].copy()
    attributes = _stored(draw, gltf, columns)
    if draw(st.booleans()):
        _make_sparse(draw, gltf, attributes["POSITION"], positions)
    parts = np.array_split(triangles, draw(st.integers(1, 2)))
    index_type = draw(st.sampled_from([np.uint8, np.uint16, np.uint32]))
    target = {"POSITION": gltf.accessor(np.ones_like(positions))}
    return [
        {
            "attributes": attributes,
            "indices": gltf.accessor(part.astype(index_type).reshape(-1)),
            "extras": draw(_EXTRAS),
        }
        | ({"targets": [target]} if draw(st.booleans()) else {})
        for part in parts
    ]


def _stored(draw: st.DrawFn, gltf: Gltf, columns: dict[str, Floats]) -> dict[str, int]:
    if not draw(st.booleans()):
        return {name: gltf.accessor(values) for name, values in columns.items()}
    count = len(columns["POSITION"])
    padding = draw(st.sampled_from([0, 4, 8]))
    rows = np.dtype([(name, "<f4", v.shape[1]) for name, v in columns.items()])
    table = np.zeros((count, rows.itemsize + padding), dtype=np.uint8)
    packed = np.zeros(count, dtype=rows)
    for name, values in columns.items():
        packed[name] = values
    table[:, : rows.itemsize] = packed.view(np.uint8).reshape(count, -1)
    view = gltf.view(table.tobytes(), stride=table.shape[1])
    offsets = {name: int(rows.fields[name][1]) for name in columns}  # type: ignore[index]
    return {name: gltf.accessor(values, view, offsets[name]) for name, values in columns.items()}


def _make_sparse(draw: st.DrawFn, gltf: Gltf, accessor: int, positions: Floats) -> None:
    rows = sorted(draw(st.sets(st.integers(0, len(positions) - 1), min_size=1, max_size=4)))
    gltf.json["accessors"][accessor]["sparse"] = {
        "count": len(rows),
        "indices": {"bufferView": gltf.view(bytes(rows)), "componentType": 5121},
        "values": {"bufferView": gltf.view(positions[rows].tobytes())},
    }


def _transform(draw: st.DrawFn) -> dict[str, Any]:
    return draw(
        st.sampled_from(
            [
                {},
                {"scale": [-1, 2, 0.5]},
                {"rotation": [0, 0.6, 0, 0.8], "translation": [0, 0, 1]},
                {"matrix": [0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 2, 0, 1, 1, 1, 1]},
            ]
        )
    )


def _surroundings(draw: st.DrawFn, gltf: Gltf) -> None:
    times = gltf.accessor(np.array([0, 1], dtype=np.float32))
    turns = gltf.accessor(np.array([[0, 0, 0, 1]] * 2, dtype=np.float32))
    unknown = {"ACME_gizmo": {"accessors": [{"min": [0]}], "nodes": draw(_EXTRAS)}}
    everything: dict[str, Any] = {
        "animations": [
            {
                "channels": [{"sampler": 0, "target": {"node": 0, "path": "rotation"}}],
                "samplers": [{"input": times, "output": turns}],
            }
        ],
        "images": [{"bufferView": gltf.view(b"\x89PNG..."), "mimeType": "image/png"}],
        "materials": [{"name": draw(_NAMES), "extensions": unknown}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.01}}],
        "extensionsUsed": ["ACME_gizmo", "KHR_texture_transform"],
        "extensions": unknown,
        "extras": draw(_EXTRAS),
    }
    gltf.json |= {key: value for key, value in everything.items() if draw(st.booleans())}
    gltf.json["scenes"].append({"nodes": [], "extras": draw(_EXTRAS)})


def _shuffled(draw: st.DrawFn, document: dict[str, Any]) -> dict[str, Any]:
    return {key: document[key] for key in draw(st.permutations(list(document)))}
