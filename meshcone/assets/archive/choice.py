"""Which file of an archive is the mesh, and what comes with it."""

from __future__ import annotations

import posixpath
import unicodedata
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import PurePosixPath

from meshcone.assets.archive.directory import Directory, content_of
from meshcone.assets.archive.rewriting import with_content
from meshcone.errors import InputError
from meshcone.files import MeshFile
from meshcone.relative_names import inside

_LISTED = 8


@dataclass(frozen=True)
class Packed:
    """A mesh in an archive.

    Attributes:
        mesh: the mesh, called by its path there, with the other files by their paths from its
            folder; those of files beyond that begin with ``../``.
        data: the archive.
    """

    mesh: MeshFile
    data: bytes = field(repr=False)
    directory: Directory = field(repr=False)

    def around(self, content: bytes) -> bytes:
        """The archive with other bytes for the mesh; every other file keeps its own."""
        if content == self.mesh.data:
            return self.data
        return with_content(self.data, self.directory, self.mesh.name, content)


def unpack(
    data: bytes,
    directory: Directory,
    suffixes: Collection[str],
    member: str | None = None,
    *,
    required: bool = True,
) -> Packed:
    """Take the mesh out of an archive, with all that is beside it.

    Args:
        data: the archive.
        directory: what is in it.
        suffixes: how the names of meshes end.
        member: the path of the mesh; without one it has to be obvious: the only mesh, or the
            only one nearest to the archive's root.
        required: whether an archive without ``member`` is refused, rather than searched.

    Raises:
        InputError: a file in it is damaged, or none or more than one can be meant.
    """
    name = None if member is None else _named(directory, member, required=required)
    name = name or _obvious(directory, suffixes)
    contents = {each: content_of(data, entry) for each, entry in directory.files.items()}
    mesh = MeshFile(name, contents.pop(name), _from_folder_of(name, contents))
    return Packed(mesh, data, directory)


def _named(directory: Directory, member: str, *, required: bool) -> str | None:
    spelled = unicodedata.normalize("NFC", member)
    for path in (inside(spelled), spelled):  # a name with a colon is no path that others can use
        if path in directory.files:
            return path
    if required:
        raise InputError(
            f"option 'member': the archive has no '{member[:200]}'; it has "
            f"{_list(list(directory.files))}"
        )
    return None


def _obvious(directory: Directory, suffixes: Collection[str]) -> str:
    meshes = [each for each in directory.files if _is_mesh(PurePosixPath(each), suffixes)]
    if not meshes:
        raise InputError(
            f"the archive has no mesh in it: looked for {', '.join(sorted(suffixes))}; it has "
            f"{_list(list(directory.files))}"
        )
    least = min(each.count("/") for each in meshes)
    nearest = [each for each in meshes if each.count("/") == least]
    if len(nearest) > 1:
        raise InputError(
            f"the archive has several meshes: {_list(nearest)}; name the one that is meant in "
            "the option 'member' (of a reference, in 'of_reference.member')"
        )
    return nearest[0]


def _is_mesh(path: PurePosixPath, suffixes: Collection[str]) -> bool:
    # macOS keeps a shadow of each file below __MACOSX, with the file's own suffix.
    hidden = any(part.startswith(".") or part == "__MACOSX" for part in path.parts)
    return path.suffix.lower() in suffixes and not hidden


def _from_folder_of(name: str, contents: Mapping[str, bytes]) -> dict[str, bytes]:
    folder = posixpath.dirname(name) or "."
    return {posixpath.relpath(each, folder): content for each, content in contents.items()}


def _list(names: list[str]) -> str:
    shown = ", ".join(f"'{each[:100]}'" for each in names[:_LISTED])
    more = len(names) - _LISTED
    return f"{shown or 'no file'}{f' and {more:,} more' if more > 0 else ''}"
