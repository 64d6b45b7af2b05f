"""Compressed data in, arrays out.

The decoders are C++ that trusts its input more than this project does: hostile data can make them
allocate without end or crash. So they run in a process of its own, with bounds on memory and time
that follow from what the document declares, and die there.
"""

from __future__ import annotations

import io
import signal
import struct
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.gltf.decoding.child import OUT_OF_MEMORY, REFUSED
from meshcone.errors import InputError, InternalError, LimitError, MeshConeError
from meshcone.lifeline import tied_command

Decoder = Literal["draco", "meshopt"]

_CALLED: dict[Decoder, str] = {"draco": "Draco", "meshopt": "meshopt"}
_CHILD = Path(__file__).with_name("child.py")
_BASE_MEMORY = 256 << 20  # Python, NumPy and the decoder, idle
_MEMORY_PER_BYTE = 8  # of what goes in and comes out; half of it was enough in every trial
_BASE_SECONDS = 5
_BYTES_PER_SECOND = 4 << 20  # a tenth of what it does on a slow machine
_UNEXPECTED = 1  # exit code of Python where an exception is not caught


@dataclass(frozen=True)
class Blob:
    """Data for a decoder.

    Attributes:
        data: what it is given.
        size: bytes that are declared to come of it.
        place: where it stands in the document.
    """

    data: bytes
    size: int
    place: str


def decode(decoder: Decoder, blobs: Sequence[Blob]) -> list[dict[str, NDArray[Any]]]:
    """The arrays that each blob holds, by name.

    Raises:
        InputError: a blob is damaged, or made the decoder crash.
        LimitError: decoding took more memory or time than the declared size explains.
        InternalError: the decoder is not installed.
    """
    if not blobs:
        return []
    called = _CALLED[decoder]
    size = sum(blob.size + len(blob.data) for blob in blobs)
    seconds = _BASE_SECONDS + size // _BYTES_PER_SECOND
    memory = _BASE_MEMORY + _MEMORY_PER_BYTE * size
    head = struct.pack("<QQQ", memory, seconds, len(blobs))
    lengths = struct.pack(f"<{len(blobs)}Q", *(len(blob.data) for blob in blobs))
    try:
        run = subprocess.run(  # noqa: S603 - our own interpreter and file
            tied_command([sys.executable, "-I", str(_CHILD), decoder], signal.SIGKILL),
            input=b"".join([head, lengths, *(blob.data for blob in blobs)]),
            capture_output=True,
            timeout=2 * seconds,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        place = _reached(blobs, error.stderr or b"")
        raise LimitError(
            f"the {called} data took over {2 * seconds} s to decode", place=place
        ) from None
    if run.returncode:
        raise _failure(called, run.returncode, _reached(blobs, run.stderr))
    return _arrays(run.stdout, len(blobs))


def _reached(blobs: Sequence[Blob], progress: bytes) -> str:
    dots = len(progress) - len(progress.lstrip(b"."))
    return blobs[max(dots - 1, 0)].place


def _failure(called: str, code: int, place: str) -> MeshConeError:
    if code == REFUSED:
        return InputError(f"the {called} data are damaged", place=place)
    if code == OUT_OF_MEMORY:
        return LimitError(
            f"the {called} data take more memory to decode than their size explains",
            place=place,
        )
    if code == _UNEXPECTED:
        return InternalError(f"the {called} decoder cannot be run here", place=place)
    return InputError(f"the {called} data make the decoder crash (exit code {code})", place=place)


def _arrays(archive: bytes, count: int) -> list[dict[str, NDArray[Any]]]:
    found: list[dict[str, NDArray[Any]]] = [{} for _ in range(count)]
    with np.load(io.BytesIO(archive), allow_pickle=False) as arrays:
        for key in arrays.files:
            number, _, name = key.partition("/")
            found[int(number)][name] = arrays[key]
    return found
