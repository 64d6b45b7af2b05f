"""Meshes on this machine, with the files beside them that they name."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path, PurePosixPath
from typing import Any, TypeVar

from meshcone.errors import InputError
from meshcone.files import MeshFile
from meshcone.places import is_file, reason
from meshcone.relative_names import from_uri, inside, sent_as
from meshcone.text import BYTE_ORDER_MARK, words_of

_BEGINNING = 1024  # bytes; white space before a document is short
_BINARY = b"glTF"
_CHUNK_AT = 20  # bytes from the start of a GLB to the data of its first chunk
_LIBRARY = re.compile(rb"mtllib[ \t]+([^\r\n]*)")
_MOST_NAMED = 10  # files in one sentence

T = TypeVar("T")


def read_local(path: Path, also: str | None = None) -> MeshFile:
    """Read a mesh and the files it names; and a file that its options name.

    Those are the buffers and images of a glTF, the material libraries of an OBJ and the images
    that these name. Only names within the mesh's folder are followed: a mesh from elsewhere must
    not pick files of this machine. What is named and not there is left for the reader to
    complain of.

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
    if name is None or name in resources or not is_file(path.parent / name):
        return resources
    return {**resources, name: read_bytes(path.parent / name)}


def files_of(path: Path, also: str | None = None) -> list[Path]:
    """A mesh on this machine, and the files beside it that :func:`read_local` reads with it."""
    listed = [] if also is None else [path.parent / also]
    if not is_file(path):
        return [path, *listed]  # what is read of a pipe here would be missing later
    try:
        with path.open("rb") as file:
            names_files = _names_files(path, file.read(_BEGINNING))
        # Whatever names no files is not read: it can be large.
        named = _beside(path, path.read_bytes()).values() if names_files else ()
    except OSError:
        named = ()
    return list(dict.fromkeys([path, *named, *listed]))


def names_beside(data: bytes) -> Iterator[str]:
    """The names, within its own folder, that a glTF has for its buffers and images.

    Args:
        data: the file, as text or binary; of a binary one, its first chunk will do.
    """
    return filter(None, map(from_uri, _uris(_document(data))))


def left_behind(source: MeshFile, written: bytes, place: Path) -> str | None:
    """What to tell of files that a written mesh names and that do not stand beside it as sent.

    Args:
        source: the mesh that was sent, and the files it came with.
        written: the mesh that was made of it.
        place: where that was written.

    Returns:
        A sentence; None where every file is there, or the mesh went into a device or a pipe.
    """
    if not place.is_file():
        return None
    named = _sent_with(source, written)
    missing = [
        n for n, sent in named.items() if not _holds(place.parent / n, source.resources[sent])
    ]
    if not missing:
        return None
    listed = ", ".join(missing[:_MOST_NAMED])
    more = f" and {len(missing) - _MOST_NAMED:,} more" if len(missing) > _MOST_NAMED else ""
    return (
        f"{place} needs files that came with {source.name} and are not beside it, or are others "
        f"there: {listed}{more}"
    )


def read_bytes(path: Path) -> bytes:
    """Read a file.

    Raises:
        InputError: it cannot be read.
    """
    try:
        return path.read_bytes()
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be read: {reason(error)}", file=str(path)) from None


def _beside(path: Path, data: bytes) -> dict[str, Path]:
    """The files that are there, by the names within the mesh's folder that it has for them."""

    def existing(names: Iterable[str]) -> dict[str, Path]:
        return _existing(path.parent, names)

    if path.suffix.lower() == ".obj":
        return _named_by_obj(data, existing, read_bytes)
    return existing(names_beside(data))


def _sent_with(source: MeshFile, data: bytes) -> dict[str, str]:
    """The files that a mesh came with and names, by the names that it has for them."""
    sent = source.resources

    def existing(names: Iterable[str]) -> dict[str, str]:
        found = {name: sent_as(name, sent) for name in filter(None, map(inside, names))}
        return {name: key for name, key in found.items() if key is not None}

    if source.name.lower().endswith(".obj"):
        return _named_by_obj(data, existing, sent.__getitem__)
    return existing(names_beside(data))


def _named_by_obj(
    data: bytes, existing: Callable[[Iterable[str]], dict[str, T]], read: Callable[[T], bytes]
) -> dict[str, T]:
    """Material libraries, and the images that they name from where they are.

    Args:
        data: the OBJ.
        existing: where files are, those of some names that are there.
        read: gives the bytes of one.
    """
    libraries = existing(n for words in _libraries(data) for n in _possible(words))
    images: dict[str, T] = {}
    for name, place in libraries.items():
        within = PurePosixPath(name).parent
        for image in _named_images(read(place)):
            # A path of the machine that wrote it says no more than its last part.
            last = image.replace("\\", "/").rpartition("/")[2]
            for each in (f"{within}/{image}", image, f"{within}/{last}"):
                found = existing([each])
                images |= found
                if found:
                    break
    return libraries | images


def _existing(folder: Path, names: Iterable[str]) -> dict[str, Path]:
    places = {name: folder / name for name in filter(None, map(inside, names))}
    return {name: place for name, place in places.items() if is_file(place)}


def _holds(place: Path, data: bytes) -> bool:
    """Whether a file is there and has these bytes."""
    try:
        return place.stat().st_size == len(data) and place.read_bytes() == data
    except OSError:
        return False


def _named_images(library: bytes) -> Iterable[str]:
    # The reader brings NumPy, whose threads are set before it is loaded.
    from meshcone.assets.obj.materials import named_images

    return named_images(library)


def _libraries(data: bytes) -> Iterator[bytes]:
    """What follows ``mtllib`` where a line begins with it."""
    for found in _LIBRARY.finditer(data):
        line = max(data.rfind(each, 0, found.start()) for each in (b"\n", b"\r")) + 1
        if not data[line : found.start()].removeprefix(BYTE_ORDER_MARK).strip():
            yield found[1].strip()


def _possible(statement: bytes) -> Iterator[str]:
    """The names that a statement may mean: it can name several, or one with blanks in it.

    A number sign is of a name or begins a comment.
    """
    words = statement.decode("utf-8", "replace")
    before = words.partition("#")[0].rstrip(" \t")
    yield from dict.fromkeys((words, before, *words_of(words), *words_of(before)))


def _names_files(path: Path, beginning: bytes) -> bool:
    return path.suffix.lower() == ".obj" or _is_document(beginning) or beginning.startswith(_BINARY)


def _is_document(beginning: bytes) -> bool:
    return beginning.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(b"{")


def _document(data: bytes) -> dict[str, Any]:
    """The JSON of a glTF; empty where the file is none, or is malformed."""
    if data.startswith(_BINARY):
        data = _first_chunk(data)
    if not _is_document(data):
        return {}
    try:
        document = json.loads(data)
    except (ValueError, RecursionError):
        return {}
    return document if isinstance(document, dict) else {}


def _first_chunk(data: bytes) -> bytes:
    # glTF 2.0, section 4.4: magic, version and length, then length and type of the first chunk.
    if len(data) < _CHUNK_AT:
        return b""
    length = int.from_bytes(data[_CHUNK_AT - 8 : _CHUNK_AT - 4], "little")
    return data[_CHUNK_AT : _CHUNK_AT + length]


def _uris(document: dict[str, Any]) -> Iterator[str]:
    for array in ("buffers", "images"):
        holders = document.get(array)
        for holder in holders if isinstance(holders, list) else ():
            uri = holder.get("uri") if isinstance(holder, dict) else None
            if isinstance(uri, str) and uri[:5].lower() != "data:":
                yield uri
