"""Draco data in, arrays out, with the decoder at arm's length.

The decoder is C++ that trusts its input more than this project does: hostile data can make it
allocate without end or crash. So it runs in a process of its own, with bounds on memory and
time that follow from what the document declares, and dies there.
"""

from __future__ import annotations

import io
import struct
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.gltf.draco.child import OUT_OF_MEMORY, REFUSED
from meshcone.errors import InputError, InternalError, LimitError, MeshConeError

_CHILD = Path(__file__).with_name("child.py")
_BASE_MEMORY = 256 << 20  # Python, NumPy and the decoder, idle
_MEMORY_PER_BYTE = 8  # of what goes in and comes out; half of it was enough in every trial
_BASE_SECONDS = 5
_BYTES_PER_SECOND = 4 << 20  # a tenth of what it does on a slow machine
_UNEXPECTED = 1  # exit code of Python where an exception is not caught
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


def decode_draco(blobs: Sequence[DracoData]) -> list[DracoMesh]:
    """Decode bitstreams.

    Raises:
        InputError: one is no Draco mesh, or not the one that is declared; or the decoder crashed.
        LimitError: decoding took more memory or time than its declared size explains.
        InternalError: the decoder is not installed.
    """
    for blob in blobs:
        check_header(blob)
    if not blobs:
        return []
    size = sum(blob.size for blob in blobs) + sum(len(blob.data) for blob in blobs)
    seconds = _BASE_SECONDS + size // _BYTES_PER_SECOND
    memory = _BASE_MEMORY + _MEMORY_PER_BYTE * size
    head = struct.pack("<QQQ", memory, seconds, len(blobs))
    lengths = struct.pack(f"<{len(blobs)}Q", *(len(blob.data) for blob in blobs))
    try:
        run = subprocess.run(  # noqa: S603 - our own interpreter and file
            [sys.executable, "-I", str(_CHILD)],
            input=b"".join([head, lengths, *(blob.data for blob in blobs)]),
            capture_output=True,
            timeout=2 * seconds,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        place = _reached(blobs, error.stderr or b"")
        raise LimitError(
            f"the Draco data took over {2 * seconds} s to decode", place=place
        ) from None
    if run.returncode:
        raise _failure(run.returncode, _reached(blobs, run.stderr))
    return _meshes(run.stdout, len(blobs))


def check_header(blob: DracoData) -> None:
    """Compare what a bitstream's header declares with what the document does.

    Source: Draco bitstream specification 2.2, "Draco Header" and "Decode Connectivity Data".

    Raises:
        InputError: it is no mesh of bitstream 2, or has other triangles or more vertices.
    """
    if len(blob.data) < _HEADER.size:
        raise InputError("the Draco data are cut short", place=blob.place)
    magic, major, minor, kind, method, flags = _HEADER.unpack_from(blob.data)
    if magic != _MAGIC or kind != _MESH or method not in (_SEQUENTIAL, _EDGEBREAKER):
        raise InputError("the bytes are no Draco mesh", place=blob.place)
    if major != 2:
        raise InputError(f"Draco bitstream {major}.{minor}; 2.2 is supported", place=blob.place)
    if flags & _METADATA or minor < 2:
        return  # the counts stand behind what only the decoder reads
    # An edgebreaker bitstream counts vertices before seams split them, and has its own first byte.
    start = _HEADER.size + (method == _EDGEBREAKER)
    first, start = _varint(blob, start)
    second, _ = _varint(blob, start)
    triangles, vertices = (first, second) if method == _SEQUENTIAL else (second, first)
    if triangles != blob.triangles:
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


def _reached(blobs: Sequence[DracoData], progress: bytes) -> str:
    dots = len(progress) - len(progress.lstrip(b"."))
    return blobs[max(dots - 1, 0)].place


def _failure(code: int, place: str) -> MeshConeError:
    if code == REFUSED:
        return InputError("the Draco data are damaged", place=place)
    if code == OUT_OF_MEMORY:
        return LimitError("the Draco data need more memory than their size explains", place=place)
    if code == _UNEXPECTED:
        return InternalError("the Draco decoder cannot be run here", place=place)
    return InputError(f"the Draco data make the decoder crash (exit code {code})", place=place)


def _meshes(archive: bytes, count: int) -> list[DracoMesh]:
    faces: dict[int, NDArray[Any]] = {}
    attributes: list[dict[int, NDArray[Any]]] = [{} for _ in range(count)]
    with np.load(io.BytesIO(archive), allow_pickle=False) as arrays:
        for key in arrays.files:
            number, _, name = key.partition("/")
            if name == "faces":
                faces[int(number)] = arrays[key]
            else:
                attributes[int(number)][int(name)] = arrays[key]
    return [DracoMesh(faces[number], attributes[number]) for number in range(count)]
