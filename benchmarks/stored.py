"""Faces and texture coordinates as a file stores them, read without the engine's own readers.

A check of what the engine writes must not rest on how the engine reads.
"""

from __future__ import annotations

import base64
import json
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any
from urllib.parse import unquote

_COMPONENT_BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
_COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}


@dataclass(frozen=True)
class Stored:
    """What a refinement must leave as it is.

    Attributes:
        faces: of an OBJ the ``v`` and ``vt`` indices of each corner, line by line; of a glTF the
            mode and the indices of each primitive.
        texture_coordinates: every ``vt`` line, or every ``TEXCOORD_n`` of each primitive.
    """

    faces: tuple[bytes, ...]
    texture_coordinates: tuple[bytes, ...]


def read_stored(data: bytes, resources: Mapping[str, bytes]) -> Stored:
    """Read an OBJ, GLB or glTF file.

    Args:
        data: the file.
        resources: the buffers a glTF names, by their names.
    """
    if data.startswith(b"glTF") or data.lstrip().startswith(b"{"):
        return _read_document(*document_and_binary(data), resources)
    lines = [line.split() for line in data.splitlines()]
    return Stored(
        faces=tuple(_without_normals(line) for line in lines if line[:1] == [b"f"]),
        texture_coordinates=tuple(b" ".join(line) for line in lines if line[:1] == [b"vt"]),
    )


def _without_normals(line: list[bytes]) -> bytes:
    corners = (corner.split(b"/") for corner in line[1:])
    return b" ".join(b"/".join(corner[:2]) for corner in corners)


def _read_document(
    document: dict[str, Any], binary: bytes, resources: Mapping[str, bytes]
) -> Stored:
    buffers = [buffer_bytes(entry, binary, resources) for entry in document.get("buffers", [])]
    primitives = [entry for mesh in document["meshes"] for entry in mesh["primitives"]]
    return Stored(
        faces=tuple(
            bytes([entry.get("mode", 4)])
            + (accessor_bytes(document, buffers, entry["indices"]) if "indices" in entry else b"")
            for entry in primitives
        ),
        texture_coordinates=tuple(
            accessor_bytes(document, buffers, entry["attributes"][name])
            for entry in primitives
            for name in sorted(entry["attributes"])
            if name.startswith("TEXCOORD_")
        ),
    )


def document_and_binary(data: bytes) -> tuple[dict[str, Any], bytes]:
    """The JSON of a glTF or GLB file, and the BIN chunk."""
    if not data.startswith(b"glTF"):
        return json.loads(data.removeprefix(b"\xef\xbb\xbf")), b""
    chunks = dict(_glb_chunks(data))
    return json.loads(chunks[b"JSON"]), chunks.get(b"BIN\0", b"")


def _glb_chunks(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    offset = 12
    while offset < len(data):
        length, kind = struct.unpack_from("<I4s", data, offset)
        yield kind, data[offset + 8 : offset + 8 + length]
        offset += 8 + length


def buffer_bytes(entry: dict[str, Any], binary: bytes, resources: Mapping[str, bytes]) -> bytes:
    """A buffer's bytes, wherever they are."""
    uri = entry.get("uri")
    if uri is None:
        return binary
    if uri.startswith("data:"):
        return base64.b64decode(uri.partition(",")[2])
    return resources[unquote(uri)]


def accessor_bytes(document: dict[str, Any], buffers: list[bytes], index: int) -> bytes:
    """An accessor's elements as stored, without what lies between them or is stored apart."""
    accessor = document["accessors"][index]
    size = _COMPONENTS[accessor["type"]] * _COMPONENT_BYTES[accessor["componentType"]]
    view = document["bufferViews"][accessor["bufferView"]]
    start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    stride = view.get("byteStride", size)
    buffer = buffers[view["buffer"]]
    rows = range(start, start + stride * accessor["count"], stride)
    return b"".join(buffer[row : row + size] for row in rows)
