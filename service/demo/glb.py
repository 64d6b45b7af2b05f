"""A writer for small GLB files: one node, one mesh, a primitive for each material.

Source: Khronos glTF 2.0 Specification (ISO/IEC 12113:2022), sections 3.6, 3.7 and 4.4.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

_ARRAY_BUFFER, _ELEMENT_ARRAY_BUFFER = 34962, 34963
_UNSIGNED_SHORT, _FLOAT = 5123, 5126
_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3"}
_JSON_CHUNK, _BINARY_CHUNK = 0x4E4F534A, 0x004E4942

Colour = tuple[float, float, float]


@dataclass(frozen=True)
class Material:
    """A plain metallic-roughness material; the colour is linear RGB in [0, 1]."""

    name: str
    colour: Colour
    metallic: float
    roughness: float


@dataclass(frozen=True)
class Patch:
    """A textured piece of surface, split at its seams.

    Attributes:
        positions: (r, 3) in the node's own space.
        normals: (r, 3) unit vectors.
        uv: (r, 2) texture coordinates.
        triangles: (k, 3) indices below 65,535, counter-clockwise seen from outside.
    """

    positions: NDArray[np.float64]
    normals: NDArray[np.float64]
    uv: NDArray[np.float64]
    triangles: NDArray[np.int64]


@dataclass(frozen=True)
class Placement:
    """Where the node puts its mesh: scaled, then rotated, then translated.

    Attributes:
        translation: in model units.
        rotation: unit quaternion x, y, z, w.
        scale: the same along all axes.
    """

    translation: tuple[float, float, float]
    rotation: tuple[float, float, float, float]
    scale: float


def write_glb(name: str, parts: Sequence[tuple[Patch, Material]], placement: Placement) -> bytes:
    """Write a GLB file whose one mesh has a primitive for each part."""
    buffer = _Buffer()
    primitives = [
        {
            "attributes": {
                "POSITION": buffer.add_vectors(patch.positions, bounds=True),
                "NORMAL": buffer.add_vectors(patch.normals),
                "TEXCOORD_0": buffer.add_vectors(patch.uv),
            },
            "indices": buffer.add_indices(patch.triangles),
            "material": number,
        }
        for number, (patch, _) in enumerate(parts)
    ]
    document = {
        "asset": {"version": "2.0", "generator": "MeshCone demo"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [
            {
                "name": name,
                "mesh": 0,
                "translation": placement.translation,
                "rotation": placement.rotation,
                "scale": [placement.scale] * 3,
            }
        ],
        "meshes": [{"name": name, "primitives": primitives}],
        "materials": [_material(material) for _, material in parts],
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": len(buffer.data)}],
    }
    return _container(document, bytes(buffer.data))


class _Buffer:
    """The binary chunk as it grows, and what describes it."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def add_vectors(self, rows: NDArray[np.float64], *, bounds: bool = False) -> int:
        values = rows.astype("<f4")
        accessor: dict[str, Any] = {"type": _TYPES[values.shape[1]], "componentType": _FLOAT}
        if bounds:
            accessor |= {
                "min": values.min(axis=0).tolist(),
                "max": values.max(axis=0).tolist(),
            }
        return self._add(values.tobytes(), len(values), accessor, _ARRAY_BUFFER)

    def add_indices(self, triangles: NDArray[np.int64]) -> int:
        accessor = {"type": "SCALAR", "componentType": _UNSIGNED_SHORT}
        data = triangles.astype("<u2").tobytes()
        return self._add(data, triangles.size, accessor, _ELEMENT_ARRAY_BUFFER)

    def _add(self, data: bytes, count: int, accessor: dict[str, Any], target: int) -> int:
        self.views.append(
            {
                "buffer": 0,
                "byteOffset": len(self.data),
                "byteLength": len(data),
                "target": target,
            }
        )
        self.data += _padded(data, b"\0")
        self.accessors.append({"bufferView": len(self.views) - 1, "count": count, **accessor})
        return len(self.accessors) - 1


def _material(material: Material) -> dict[str, Any]:
    return {
        "name": material.name,
        "pbrMetallicRoughness": {
            "baseColorFactor": [*material.colour, 1.0],
            "metallicFactor": material.metallic,
            "roughnessFactor": material.roughness,
        },
    }


def _container(document: dict[str, Any], binary: bytes) -> bytes:
    text = _padded(json.dumps(document, separators=(",", ":")).encode(), b" ")
    chunks = struct.pack("<II", len(text), _JSON_CHUNK) + text
    chunks += struct.pack("<II", len(binary), _BINARY_CHUNK) + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def _padded(data: bytes, filler: bytes) -> bytes:
    return data + filler * (-len(data) % 4)
