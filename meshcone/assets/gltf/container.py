"""The GLB container (glTF 2.0, section 4.4): a header and length-prefixed chunks."""

from __future__ import annotations

import struct
from dataclasses import dataclass

from meshcone.assets.limits import Limits
from meshcone.errors import InputError

_HEADER = struct.Struct("<4sII")
_CHUNK = struct.Struct("<II")
_JSON = 0x4E4F534A
_BIN = 0x004E4942


@dataclass(frozen=True)
class Chunk:
    """One chunk, padding included."""

    kind: int
    data: bytes


@dataclass(frozen=True)
class Container:
    """A GLB file: its JSON, its binary buffer if it has one, and whatever else it carries.

    Attributes:
        chunks: all chunks in file order.
        trailing: bytes after the declared length.
    """

    chunks: tuple[Chunk, ...]
    trailing: bytes

    @property
    def json(self) -> bytes:
        """What the first chunk holds; some exporters pad it with zeros, where blanks belong."""
        return self.chunks[0].data.rstrip(b"\0")

    @property
    def binary(self) -> bytes | None:
        """The second chunk, if it is a buffer."""
        has_binary = len(self.chunks) > 1 and self.chunks[1].kind == _BIN
        return self.chunks[1].data if has_binary else None


def split_glb(data: bytes, limits: Limits) -> Container:
    """Check the header and lengths and cut the file into chunks.

    Raises:
        InputError: not version 2, shorter than declared, or chunks missing or out of order.
        LimitError: more chunks than ``limits`` accept.
    """
    if len(data) < _HEADER.size:
        raise InputError(
            f"a GLB header has {_HEADER.size} bytes, the file {len(data)}", place="byte 0"
        )
    _, version, length = _HEADER.unpack_from(data)
    if version != 2:
        raise InputError(f"GLB version {version}; expected version 2", place="byte 4")
    if length > len(data):
        raise InputError(
            f"the header declares {length:,} bytes, the file has {len(data):,}: it is cut short",
            place="byte 8",
        )
    if length < _HEADER.size + _CHUNK.size:
        raise InputError(f"the header declares only {length} bytes", place="byte 8")
    chunks: list[Chunk] = []
    offset = _HEADER.size
    while offset < length:
        limits.check("chunks", len(chunks) + 1, "chunks", place=f"byte {offset}")
        chunk = _chunk_at(data, offset, length)
        chunks.append(chunk)
        offset += _CHUNK.size + len(chunk.data)
    _check_order(chunks)
    return Container(tuple(chunks), data[length:])


def join_glb(container: Container, text: str, binary: bytes | None) -> bytes:
    """The same container around another JSON text and binary buffer."""
    json_bytes = text.encode()
    zeros = len(container.chunks[0].data) - len(container.json)
    if (len(json_bytes) + zeros) % 4:
        json_bytes = json_bytes.rstrip(b" ")
        json_bytes += (b"\0" if zeros else b" ") * (-len(json_bytes) % 4)
    else:
        json_bytes += bytes(zeros)
    payloads = [json_bytes, *(chunk.data for chunk in container.chunks[1:])]
    if binary is not None:
        payloads[1] = binary
    body = b"".join(
        _CHUNK.pack(len(payload), chunk.kind) + payload
        for chunk, payload in zip(container.chunks, payloads, strict=True)
    )
    header = _HEADER.pack(b"glTF", 2, _HEADER.size + len(body))
    return header + body + container.trailing


def _chunk_at(data: bytes, offset: int, length: int) -> Chunk:
    place = f"byte {offset}"
    if offset + _CHUNK.size > length:
        raise InputError("the file ends within a chunk's header", place=place)
    size, kind = _CHUNK.unpack_from(data, offset)
    start = offset + _CHUNK.size
    if start + size > length:
        raise InputError(
            f"a chunk declares {size:,} bytes, {length - start:,} are left", place=place
        )
    return Chunk(kind, data[start : start + size])


def _check_order(chunks: list[Chunk]) -> None:
    offset = _HEADER.size
    for number, chunk in enumerate(chunks):
        place = f"byte {offset}"
        if number == 0 and chunk.kind != _JSON:
            raise InputError("the first chunk is not JSON", place=place)
        if number > 0 and chunk.kind == _JSON:
            raise InputError("the file has more than one JSON chunk", place=place)
        if number > 1 and chunk.kind == _BIN:
            raise InputError("a BIN chunk can only be the second chunk", place=place)
        offset += _CHUNK.size + len(chunk.data)
