"""Small meshes for tests, made here."""

from __future__ import annotations

import json
import struct

import numpy as np
from numpy.typing import NDArray

Vertices = NDArray[np.float64]
Faces = NDArray[np.int64]


def sphere(subdivisions: int = 3, radius: float = 2.0) -> tuple[Vertices, Faces]:
    """An octahedron, subdivided and blown up to a sphere."""
    corners = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    vertices = [np.array(corner, dtype=float) for corner in corners]
    upper = [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4)]
    faces = upper + [(b, a, 5) for a, b, _ in upper]
    for _ in range(subdivisions):
        middles: dict[tuple[int, int], int] = {}

        def middle(a: int, b: int, middles: dict[tuple[int, int], int] = middles) -> int:
            key = (min(a, b), max(a, b))
            if key not in middles:
                point = vertices[a] + vertices[b]
                middles[key] = len(vertices)
                vertices.append(point / np.linalg.norm(point))
            return middles[key]

        finer = []
        for a, b, c in faces:
            ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
            finer += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        faces = finer
    return radius * np.array(vertices), np.array(faces, dtype=np.int64)


def noisy(vertices: Vertices, amount: float = 0.05, seed: int = 7) -> Vertices:
    """The vertices with Gaussian noise, in model units."""
    return vertices + np.random.default_rng(seed).normal(scale=amount, size=vertices.shape)


def obj(vertices: Vertices, faces: Faces) -> bytes:
    """A Wavefront OBJ file."""
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices]
    lines += [f"f {a} {b} {c}" for a, b, c in faces + 1]
    return ("\n".join(lines) + "\n").encode()


def _gltf(vertices: Vertices, faces: Faces) -> tuple[dict[str, object], bytes]:
    positions, indices = vertices.astype("<f4"), faces.astype("<u4")
    binary = positions.tobytes() + indices.tobytes()
    views = [
        {"buffer": 0, "byteOffset": 0, "byteLength": positions.nbytes},
        {"buffer": 0, "byteOffset": positions.nbytes, "byteLength": indices.nbytes},
    ]
    accessors = [
        {
            "bufferView": 0,
            "componentType": 5126,
            "count": len(positions),
            "type": "VEC3",
            "min": [float(value) for value in positions.min(axis=0)],
            "max": [float(value) for value in positions.max(axis=0)],
        },
        {"bufferView": 1, "componentType": 5125, "count": indices.size, "type": "SCALAR"},
    ]
    document: dict[str, object] = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [{"byteLength": len(binary)}],
        "bufferViews": views,
        "accessors": accessors,
    }
    return document, binary


def glb(vertices: Vertices, faces: Faces) -> bytes:
    """A binary glTF file."""
    document, binary = _gltf(vertices, faces)
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    body = struct.pack("<II", len(text), 0x4E4F534A) + text
    body += struct.pack("<II", len(binary), 0x004E4942) + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body


def gltf(vertices: Vertices, faces: Faces, buffer_name: str) -> tuple[bytes, bytes]:
    """A glTF file and the buffer it names."""
    document, binary = _gltf(vertices, faces)
    document["buffers"] = [{"byteLength": len(binary), "uri": buffer_name}]
    return json.dumps(document).encode(), binary
