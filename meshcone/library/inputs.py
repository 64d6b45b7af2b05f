"""What a caller may give as a mesh, and a mesh that was loaded from it."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

from meshcone.errors import ArgumentError, InputError
from meshcone.files import MeshFile
from meshcone.local_files import files_of, read_bytes, read_local, with_file_beside
from meshcone.places import is_file
from meshcone.relative_names import inside

if TYPE_CHECKING:
    import trimesh
    from numpy.typing import ArrayLike

    from meshcone.assets.base import Asset


class MeshHolder(ABC):
    """A result that holds a mesh, which can be given wherever a mesh can."""

    @property
    @abstractmethod
    def file(self) -> LoadedMesh:
        """The mesh as a file."""


MeshLike: TypeAlias = (
    "str | os.PathLike[str] | MeshFile | MeshHolder | tuple[str, bytes] "
    "| tuple[ArrayLike, ArrayLike] | trimesh.Trimesh | trimesh.Scene"
)


@dataclass(frozen=True, repr=False)
class LoadedMesh(MeshFile):
    """A mesh in memory, as a file with all it needs.

    Attributes:
        name: file name.
        data: bytes of the file.
        resources: bytes of the files it names, such as the buffers of a ``.gltf``.
        path: where it was read from, as it was given; None if it came from memory.
        given: the ``trimesh.Trimesh`` it was made from, if it was.
        place: where that is, whatever directory the program works in by now.
    """

    path: Path | None = None
    given: Any = field(default=None, compare=False)
    place: Path | None = field(default=None, compare=False)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.name}: {len(self.data):,} bytes>"

    @cached_property
    def scene(self) -> trimesh.Scene:
        """All geometries of the file, read by trimesh, with materials and textures.

        Where trimesh finds other triangles than the engine, it has the engine's.
        """
        import trimesh

        from meshcone.library.trimeshes import scene_of

        if self.given is not None:
            return trimesh.Scene(self.mesh)
        asset = self._asset()
        beside = _Beside(asset.file.resources, None if asset.packed else self.place)
        return scene_of(asset, beside)

    @cached_property
    def mesh(self) -> trimesh.Trimesh:
        """The whole file as one ``trimesh.Trimesh``, in the file's own unit.

        A mesh that was given as a ``Trimesh`` or as arrays has its vertices and faces in the order
        they were given.

        Raises:
            InputError: the file has points alone.
        """
        import trimesh

        if self.given is not None:
            mesh = self.given.copy()
            mesh.vertices = self._asset().positions.copy()
            return mesh
        parts = self.scene.geometry.values()
        if parts and all(isinstance(each, trimesh.PointCloud) for each in parts):
            raise InputError(
                "it has points and no faces: `scene` has them as a trimesh.PointCloud",
                file=self.name,
            )
        return self.scene.to_mesh()

    def files(self) -> list[Path]:
        """The files on this machine that were read for it."""
        if self.place is None:
            return []
        beside = (self.place.parent / name for name in self.resources)
        return list(dict.fromkeys([*files_of(self.place), *filter(is_file, beside)]))

    def with_file(self, name: str | None) -> LoadedMesh:
        """The mesh with a file from beside it among its resources, which its options name.

        Raises:
            InputError: the file cannot be read.
        """
        if self.place is None:
            return self
        return replace(self, resources=with_file_beside(self.place, self.resources, name))

    def _asset(self) -> Asset:
        from meshcone.assets import read_asset

        return read_asset(self.name, self.data, self.resources)


def load(mesh: MeshLike, *, name: str | None = None) -> LoadedMesh:
    """Read a mesh once, for several calls, and check that it is one.

    Args:
        mesh: a path, whose buffers are found beside it; ``(name, bytes)``; a
            ``trimesh.Trimesh`` or ``trimesh.Scene``; ``(vertices, faces)`` of shapes (n, 3) and
            (m, 3) or (m, 4); or a result.
        name: what messages and results call it, instead of its own name.

    Raises:
        InputError, LimitError: it cannot be used; the message says which part and why.
        ArgumentError: it is none of these.
    """
    if name is not None and not isinstance(name, str):
        raise ArgumentError(f"'name' must be text, found {_described(name)}")
    loaded = load_unread(mesh, name or "mesh", renamed=name is not None)
    loaded._asset()
    return loaded


def load_unread(mesh: MeshLike, name: str, *, renamed: bool = False) -> LoadedMesh:
    """Load a mesh, whose content the engine will read.

    Args:
        mesh: as in :func:`load`.
        name: what to call a mesh that has no name.
        renamed: whether ``name`` replaces a name that it has.

    Raises:
        InputError: it cannot be read, or its arrays make no mesh.
        ArgumentError: it is nothing that can be a mesh.
    """
    loaded = _loaded(mesh, name)
    if not renamed or loaded.name == name:
        return loaded
    return replace(loaded, name=name)


def _loaded(mesh: MeshLike, name: str) -> LoadedMesh:
    if isinstance(mesh, LoadedMesh):
        return mesh
    if isinstance(mesh, MeshHolder):
        return mesh.file
    if isinstance(mesh, MeshFile):
        return LoadedMesh(mesh.name, mesh.data, mesh.resources)
    if isinstance(mesh, str | os.PathLike):
        path = Path(mesh)
        file = read_local(path)
        return LoadedMesh(file.name, file.data, file.resources, path, place=path.absolute())
    if isinstance(mesh, tuple | list) and len(mesh) == 2:  # two of anything else is no mesh
        first, second = mesh
        if isinstance(first, str) and isinstance(second, bytes | bytearray | memoryview):
            return LoadedMesh(first, bytes(second))
        if not isinstance(first, str | bytes) and not isinstance(second, str | bytes):
            from meshcone.library.conversion import from_arrays

            return LoadedMesh(*from_arrays(first, second, name))
    if isinstance(mesh, bytes | bytearray | memoryview):
        raise ArgumentError(
            'bytes need a file name, which tells their format: give ("mesh.glb", data)', file=name
        )
    # trimesh's arrays are no meshes; its geometries can be exported.
    if type(mesh).__module__.partition(".")[0] == "trimesh" and hasattr(mesh, "export"):
        from meshcone.library.conversion import from_trimesh

        return LoadedMesh(*from_trimesh(mesh, name))
    raise ArgumentError(
        "expected a path, (name, bytes), a trimesh.Trimesh or Scene, (vertices, faces), or a "
        f"result of MeshCone, found {_described(mesh)}",
        file=name,
    )


def _described(value: object) -> str:
    kind = type(value)
    shape = getattr(value, "shape", None)
    if isinstance(shape, tuple):
        return f"one {kind.__name__} of shape {shape}"
    if isinstance(value, tuple | list):
        return f"a {kind.__name__} of {len(value)}: {', '.join(type(v).__name__ for v in value)}"
    return f"a value of type {kind.__name__}"


class _Beside(Mapping[str, bytes]):
    """The files that a mesh names: those that came with it, then those in its folder."""

    def __init__(self, resources: Mapping[str, bytes], path: Path | None) -> None:
        self._resources = resources
        self._folder = None if path is None else path.parent

    def __getitem__(self, name: str) -> bytes:
        if name in self._resources:
            return self._resources[name]
        # A mesh from elsewhere must not pick files of this machine.
        path = inside(name)
        if self._folder is None or path is None:
            raise KeyError(name)
        try:
            return read_bytes(self._folder / path)
        except InputError:
            raise KeyError(name) from None

    def __iter__(self) -> Any:
        return iter(self._resources)

    def __len__(self) -> int:
        return len(self._resources)
