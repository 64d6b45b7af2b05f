"""Building a new binary glTF from arrays.

Source: Khronos glTF 2.0 Specification (ISO/IEC 12113:2022), sections 3.6, 3.7 and 4.4.
"""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

_ARRAY_BUFFER, _ELEMENT_ARRAY_BUFFER = 34962, 34963
_UNSIGNED_BYTE, _UNSIGNED_SHORT, _UNSIGNED_INT, _FLOAT = 5121, 5123, 5125, 5126
_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
_JSON_CHUNK, _BINARY_CHUNK = 0x4E4F534A, 0x004E4942
_LARGEST_SHORT_INDEX = 0xFFFE  # the last value of an index type restarts the primitive


class GlbBuilder:
    """One buffer as it grows, and the accessors into it."""

    def __init__(self) -> None:
        self._data = bytearray()
        self._views: list[dict[str, Any]] = []
        self._accessors: list[dict[str, Any]] = []

    def add_vectors(self, rows: NDArray[np.float64], *, bounds: bool = False) -> int:
        """Store (k,) numbers or (k, 2..4) vectors as float32; return their accessor.

        Args:
            rows: the values.
            bounds: whether to state their minimum and maximum, as ``POSITION`` must.
        """
        values = np.ascontiguousarray(rows, dtype="<f4").reshape(len(rows), -1)
        accessor: dict[str, Any] = {"type": _TYPES[values.shape[1]], "componentType": _FLOAT}
        if bounds:
            accessor |= {
                "min": values.min(axis=0).tolist(),
                "max": values.max(axis=0).tolist(),
            }
        return self._add(values.tobytes(), len(values), accessor, _ARRAY_BUFFER)

    def add_colours(self, rows: NDArray[np.uint8]) -> int:
        """Store (k, 4) linear RGBA colours, 255 for 1; return their accessor."""
        values = np.ascontiguousarray(rows, dtype=np.uint8)
        accessor = {"type": "VEC4", "componentType": _UNSIGNED_BYTE, "normalized": True}
        return self._add(values.tobytes(), len(values), accessor, _ARRAY_BUFFER)

    def add_shorts(self, rows: NDArray[np.uint16]) -> int:
        """Store (k, 2..4) integers of 16 bits; return their accessor."""
        values = np.ascontiguousarray(rows, dtype="<u2")
        accessor = {"type": _TYPES[values.shape[1]], "componentType": _UNSIGNED_SHORT}
        return self._add(values.tobytes(), len(values), accessor, _ARRAY_BUFFER)

    def add_file(self, data: bytes) -> int:
        """Store a file, such as an image; return its buffer view."""
        self._views.append({"buffer": 0, "byteOffset": len(self._data), "byteLength": len(data)})
        self._data += _padded(data, b"\0")
        return len(self._views) - 1

    def add_indices(self, triangles: NDArray[np.int64]) -> int:
        """Store (m, 3) vertex indices in the smallest type that holds them; return their accessor.

        A byte is left out: graphics interfaces support it badly.
        """
        short = int(triangles.max(initial=0)) <= _LARGEST_SHORT_INDEX
        kind, dtype = (_UNSIGNED_SHORT, "<u2") if short else (_UNSIGNED_INT, "<u4")
        accessor = {"type": "SCALAR", "componentType": kind}
        data = triangles.astype(dtype).tobytes()
        return self._add(data, triangles.size, accessor, _ELEMENT_ARRAY_BUFFER)

    def finish(self, document: dict[str, Any]) -> bytes:
        """The file: a document of nodes, meshes and materials around what has been stored."""
        complete = {
            **document,
            "accessors": self._accessors,
            "bufferViews": self._views,
            "buffers": [{"byteLength": len(self._data)}],
        }
        return _container(complete, bytes(self._data))

    def _add(self, data: bytes, count: int, accessor: dict[str, Any], target: int) -> int:
        self._views.append(
            {
                "buffer": 0,
                "byteOffset": len(self._data),
                "byteLength": len(data),
                "target": target,
            }
        )
        self._data += _padded(data, b"\0")
        self._accessors.append({"bufferView": len(self._views) - 1, "count": count, **accessor})
        return len(self._accessors) - 1


def _container(document: dict[str, Any], binary: bytes) -> bytes:
    text = _padded(json.dumps(document, separators=(",", ":")).encode(), b" ")
    chunks = struct.pack("<II", len(text), _JSON_CHUNK) + text
    chunks += struct.pack("<II", len(binary), _BINARY_CHUNK) + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def _padded(data: bytes, filler: bytes) -> bytes:
    return data + filler * (-len(data) % 4)
