"""Meshes on this machine, with the files beside them that they name."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import unquote

from meshcone.errors import InputError
from meshcone.files import MeshFile


def read_local(path: Path) -> MeshFile:
    """Read a mesh and, of a glTF, the buffers it names.

    Only plain names are followed: a mesh from elsewhere must not pick files of this
    machine. What is named and not there is left for the reader to complain of.

    Raises:
        InputError: the file cannot be read.
    """
    data = read_bytes(path)
    resources = {
        name: read_bytes(path.parent / name)
        for name in _named_files(data)
        if (path.parent / name).is_file()
    }
    return MeshFile(path.name, data, resources)


def read_bytes(path: Path) -> bytes:
    """Read a file.

    Raises:
        InputError: it cannot be read.
    """
    try:
        return path.read_bytes()
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise InputError(f"cannot be read: {reason}", file=str(path)) from None


def _named_files(data: bytes) -> Iterator[str]:
    if not data.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"{"):
        return  # an OBJ's materials are not needed to refine it
    try:
        document = json.loads(data)
    except (ValueError, RecursionError):
        return
    buffers = document.get("buffers") if isinstance(document, dict) else None
    for buffer in buffers if isinstance(buffers, list) else ():
        uri = buffer.get("uri") if isinstance(buffer, dict) else None
        if isinstance(uri, str) and not uri.startswith("data:"):
            name = unquote(uri)
            if name == Path(name).name and "\0" not in name:
                yield name
