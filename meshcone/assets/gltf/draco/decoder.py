"""Draco bitstreams: what their headers declare, and what they hold."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from meshcone.assets.gltf.decoding import Blob, decode
from meshcone.errors import InputError

_MAGIC = b"DRACO"
_MESH = 1
_SEQUENTIAL, _EDGEBREAKER = 0, 1
_METADATA = 0x8000
_HEADER = struct.Struct("<5sBBBBH")


@dataclass(frozen=True)
class DracoData:
    """One compressed mesh.

    Attributes:
        data: the bitstream.
        triangles, vertices: what the document declares.
        size: bytes of all declared attributes and indices.
        place: where it stands in the document.
    """

    data: bytes
    triangles: int
    vertices: int
    size: int
    place: str


@dataclass(frozen=True)
class DracoMesh:
    """What a bitstream held: (k, 3) ``faces``, and ``attributes`` (n, c) by their unique id."""

    faces: NDArray[Any]
    attributes: dict[int, NDArray[Any]]

    @property
    def vertices(self) -> int:
        """How many vertices it has."""
        return max(map(len, self.attributes.values()), default=0)


def decode_draco(blobs: Sequence[DracoData]) -> list[DracoMesh]:
    """Decode bitstreams.

    Raises:
        InputError: one is no Draco mesh, or not the one that is declared; or the decoder crashed.
        LimitError: decoding took more memory or time than its declared size explains.
        InternalError: the decoder is not installed.
    """
    for blob in blobs:
        check_header(blob)
    found = decode("draco", [Blob(blob.data, blob.size, blob.place) for blob in blobs])
    return [
        DracoMesh(
            arrays["faces"],
            {int(name): array for name, array in arrays.items() if name != "faces"},
        )
        for arrays in found
    ]


def check_header(blob: DracoData) -> None:
    """Compare what a bitstream's header declares with what the document does.

    Source: Draco bitstream specification 2.2, "Draco Header" and "Decode Connectivity Data".

    Raises:
        InputError: it is no mesh of bitstream 2, or has more triangles or vertices than those that
            are declared can have come from.
    """
    if len(blob.data) < _HEADER.size:
        raise InputError("the Draco data are cut short", place=blob.place)
    magic, major, minor, kind, method, flags = _HEADER.unpack_from(blob.data)
    if magic != _MAGIC or kind != _MESH or method not in (_SEQUENTIAL, _EDGEBREAKER):
        raise InputError("the bytes are not a Draco mesh", place=blob.place)
    if major != 2:
        raise InputError(f"Draco bitstream {major}.{minor}; 2.2 is supported", place=blob.place)
    if flags & _METADATA or minor < 2:
        return  # the counts stand behind what only the decoder reads
    # An edgebreaker bitstream counts vertices before seams split them, and has its own first byte.
    start = _HEADER.size + (method == _EDGEBREAKER)
    first, start = _varint(blob, start)
    second, _ = _varint(blob, start)
    triangles, vertices = (first, second) if method == _SEQUENTIAL else (second, first)
    if triangles > blob.triangles:
        raise InputError(
            f"the Draco data declare {triangles:,} triangles, the accessor {blob.triangles:,}",
            place=blob.place,
        )
    if vertices > max(blob.vertices, 3 * triangles):
        raise InputError(
            f"the Draco data declare {vertices:,} vertices, the accessor {blob.vertices:,}",
            place=blob.place,
        )


def _varint(blob: DracoData, start: int) -> tuple[int, int]:
    value = 0
    for number, byte in enumerate(blob.data[start : start + 5]):
        value |= (byte & 0x7F) << 7 * number
        if byte < 0x80:
            return value, start + number + 1
    raise InputError("the Draco data are cut short", place=blob.place)
