"""Meshes on this machine, with the files beside them that they name."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path

from meshcone.errors import InputError
from meshcone.files import MeshFile
from meshcone.relative_names import from_uri

_BEGINNING = 1024  # bytes; white space before a document is short


def read_local(path: Path, also: str | None = None) -> MeshFile:
    """Read a mesh and, of a glTF, the buffers it names; and a file that its options name.

    Only names within the mesh's folder are followed: a mesh from elsewhere must not pick files
    of this machine. What is named and not there is left for the reader to complain of.

    Args:
        path: the mesh.
        also: plain name of one more file beside it.

    Raises:
        InputError: the file cannot be read.
    """
    data = read_bytes(path)
    resources = {name: read_bytes(place) for name, place in _beside(path, data).items()}
    return MeshFile(path.name, data, with_file_beside(path, resources, also))


def with_file_beside(
    path: Path, resources: Mapping[str, bytes], name: str | None
) -> Mapping[str, bytes]:
    """The resources of a mesh with one more from beside it, if it is named and is there.

    Raises:
        InputError: the file cannot be read.
    """
    if name is None or name in resources or not (path.parent / name).is_file():
        return resources
    return {**resources, name: read_bytes(path.parent / name)}


def files_of(path: Path) -> list[Path]:
    """A mesh on this machine, and the files beside it that :func:`read_local` reads with it."""
    if not path.is_file():
        return [path]  # what is read of a pipe here would be missing later
    try:
        with path.open("rb") as file:
            names_files = _is_document(file.read(_BEGINNING))
        # Whatever names no files is not read: it can be large.
        return [path, *_beside(path, path.read_bytes()).values()] if names_files else [path]
    except OSError:
        return [path]


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


def _beside(path: Path, data: bytes) -> dict[str, Path]:
    places = {name: path.parent / name for name in _named_files(data)}
    return {name: place for name, place in places.items() if place.is_file()}


def _is_document(beginning: bytes) -> bool:
    return beginning.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"{")


def _named_files(data: bytes) -> Iterator[str]:
    if not _is_document(data):
        return  # an OBJ's materials are not needed to refine it
    try:
        document = json.loads(data)
    except (ValueError, RecursionError):
        return
    buffers = document.get("buffers") if isinstance(document, dict) else None
    for buffer in buffers if isinstance(buffers, list) else ():
        uri = buffer.get("uri") if isinstance(buffer, dict) else None
        if isinstance(uri, str) and not uri.startswith("data:"):
            name = from_uri(uri)
            if name is not None:
                yield name
