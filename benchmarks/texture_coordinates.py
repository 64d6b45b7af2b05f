"""Texture coordinates as a file stores them, read without the engine's own readers.

A check of what the engine writes must not rest on how the engine reads.
"""

from __future__ import annotations

import base64
import json
import struct
from collections.abc import Iterator, Mapping
from typing import Any
from urllib.parse import unquote

_COMPONENT_BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
_UV_COMPONENTS = 2


def texture_coordinates(data: bytes, resources: Mapping[str, bytes]) -> list[bytes]:
    """The stored texture coordinates of an OBJ, GLB or glTF file, bit for bit.

    Args:
        data: the file.
        resources: the buffers a glTF names, by their names.

    Returns:
        Every ``vt`` line of an OBJ; of a glTF one item for each primitive and ``TEXCOORD_n``.
    """
    if data.startswith(b"glTF"):
        document, binary = _glb_parts(data)
    elif data.lstrip().startswith(b"{"):
        document, binary = json.loads(data), b""
    else:
        return [line.strip() for line in data.splitlines() if line.lstrip().startswith(b"vt ")]
    buffers = [_buffer(entry, binary, resources) for entry in document.get("buffers", [])]
    return [
        _accessor_bytes(document, buffers, primitive["attributes"][name])
        for mesh in document["meshes"]
        for primitive in mesh["primitives"]
        for name in sorted(primitive["attributes"])
        if name.startswith("TEXCOORD_")
    ]


def _glb_parts(data: bytes) -> tuple[dict[str, Any], bytes]:
    chunks = dict(_glb_chunks(data))
    return json.loads(chunks[b"JSON"]), chunks.get(b"BIN\0", b"")


def _glb_chunks(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    offset = 12
    while offset < len(data):
        length, kind = struct.unpack_from("<I4s", data, offset)
        yield kind, data[offset + 8 : offset + 8 + length]
        offset += 8 + length


def _buffer(entry: dict[str, Any], binary: bytes, resources: Mapping[str, bytes]) -> bytes:
    uri = entry.get("uri")
    if uri is None:
        return binary
    if uri.startswith("data:"):
        return base64.b64decode(uri.partition(",")[2])
    return resources[unquote(uri)]


def _accessor_bytes(document: dict[str, Any], buffers: list[bytes], index: int) -> bytes:
    accessor = document["accessors"][index]
    size = _UV_COMPONENTS * _COMPONENT_BYTES[accessor["componentType"]]
    view = document["bufferViews"][accessor["bufferView"]]
    start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    stride = view.get("byteStride", size)
    buffer = buffers[view["buffer"]]
    rows = range(start, start + stride * accessor["count"], stride)
    return b"".join(buffer[row : row + size] for row in rows)
