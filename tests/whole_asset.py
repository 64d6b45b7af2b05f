"""A small asset that has everything: textures, two materials, a skin, an animation, a light."""

from __future__ import annotations

import base64
import io
import json
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

_COMPONENTS = {"<f4": 5126, "<u2": 5123, "|u1": 5121}
_KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


class Document:
    """A glTF that grows; its one buffer is a data URI."""

    def __init__(self) -> None:
        self.json: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "accessors": [],
            "bufferViews": [],
        }
        self._buffer = b""

    def accessor(self, values: NDArray[Any], **members: Any) -> int:
        """Store rows; their accessor."""
        rows = np.ascontiguousarray(values).reshape(len(values), -1)
        declared = {
            "componentType": _COMPONENTS[rows.dtype.str],
            "count": len(rows),
            "type": _KINDS[rows.shape[1]],
            "bufferView": self.view(rows.tobytes()),
        }
        self.json["accessors"].append(declared | members)
        return len(self.json["accessors"]) - 1

    def view(self, data: bytes) -> int:
        """Store bytes; their buffer view."""
        start = len(self._buffer)
        self._buffer += data + bytes(-len(data) % 4)
        view = {"buffer": 0, "byteOffset": start, "byteLength": len(data)}
        self.json["bufferViews"].append(view)
        return len(self.json["bufferViews"]) - 1

    def to_bytes(self) -> bytes:
        """The file."""
        uri = "data:application/octet-stream;base64," + base64.b64encode(self._buffer).decode()
        buffers = [{"byteLength": len(self._buffer), "uri": uri}]
        return json.dumps({**self.json, "buffers": buffers}).encode()


def png(color: tuple[int, ...], width: int = 8, height: int = 8) -> bytes:
    """A picture of one colour."""
    out = io.BytesIO()
    mode = "RGBA" if len(color) == 4 else "RGB"
    Image.new(mode, (width, height), color).save(out, "PNG")
    return out.getvalue()


def square(size: float = 2.0) -> dict[str, NDArray[Any]]:
    """A square in the plane z = 0, seen from above, whose texture it fills."""
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype="<f4")
    return {
        "POSITION": np.column_stack([size * corners, np.zeros(4)]).astype("<f4"),
        "NORMAL": np.tile(np.array([0, 0, 1], dtype="<f4"), (4, 1)),
        "TEXCOORD_0": (corners * (1, -1) + (0, 1)).astype("<f4"),
    }


SQUARE_FACES = np.array([[0, 1, 2], [0, 2, 3]], dtype="<u2")


def whole() -> Document:
    """Two squares beside each other, one of them skinned, and all that goes with them."""
    document = Document()
    primitives = []
    for material in (0, 1):
        arrays = square()
        arrays["POSITION"] = arrays["POSITION"] + np.array([3 * material, 0, 0], dtype="<f4")
        if material == 1:
            arrays["JOINTS_0"] = np.zeros((4, 4), dtype="|u1")
            arrays["WEIGHTS_0"] = np.tile(np.array([1, 0, 0, 0], dtype="<f4"), (4, 1))
        attributes = {name: document.accessor(values) for name, values in arrays.items()}
        indices = document.accessor(SQUARE_FACES.reshape(-1, 1))
        primitives.append({"attributes": attributes, "indices": indices, "material": material})
    images = [png((200, 100, 50)), png((128, 128, 255), 4, 4)]
    times = document.accessor(np.array([0, 0.5, 1.25], dtype="<f4").reshape(-1, 1))
    moves = document.accessor(np.zeros((3, 3), dtype="<f4"))
    binds = document.accessor(np.eye(4, dtype="<f4").reshape(1, 16))
    document.json |= {
        "scene": 0,
        "scenes": [{"name": "room", "nodes": [0]}],
        "nodes": [
            {"name": "root", "children": [1, 2], "translation": [0, 1, 0]},
            {"name": "plain", "mesh": 0},
            {"name": "bone", "extras": {"kind": "hinge"}},
        ],
        "meshes": [{"name": "squares", "primitives": primitives}],
        "materials": [
            {
                "name": "painted",
                "pbrMetallicRoughness": {
                    "baseColorTexture": {"index": 0},
                    "baseColorFactor": [1, 1, 1, 1],
                    "roughnessFactor": 0.25,
                },
                "normalTexture": {"index": 1, "scale": 0.5},
            },
            {
                "name": "glass",
                "alphaMode": "BLEND",
                "doubleSided": True,
                "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 1, 0.5], "metallicFactor": 0},
                "extensions": {"KHR_materials_ior": {"ior": 1.4}},
            },
        ],
        "textures": [{"source": 0, "sampler": 0}, {"source": 1}],
        "samplers": [{"wrapS": 33071, "wrapT": 33648, "magFilter": 9728}],
        "images": [{"bufferView": document.view(data), "mimeType": "image/png"} for data in images],
        "skins": [{"name": "rig", "joints": [2], "inverseBindMatrices": binds}],
        "animations": [
            {
                "name": "swing",
                "samplers": [{"input": times, "output": moves}],
                "channels": [{"sampler": 0, "target": {"node": 2, "path": "translation"}}],
            }
        ],
        "extensionsUsed": ["KHR_materials_ior"],
    }
    return document
