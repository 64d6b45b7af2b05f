"""Chooses the reader for a file: by its content first, by its name where content is silent."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import PurePosixPath

from meshcone.assets.archive import is_archive, read_directory, unpack
from meshcone.assets.archive.directory import Directory
from meshcone.assets.base import Asset
from meshcone.assets.converted import SUFFIXES, read_converted, recognise_converted
from meshcone.assets.converted.formats import Converted, recognise_package
from meshcone.assets.foreign import read_foreign, recognise_foreign
from meshcone.assets.gltf import read_glb, read_gltf
from meshcone.assets.limits import Limits
from meshcone.assets.obj import read_obj
from meshcone.assets.pointers import refuse_pointer
from meshcone.assets.points import PointAsset, read_xyz
from meshcone.assets.policy import ALL_SCENES, ReadPolicy
from meshcone.errors import InputError, naming
from meshcone.files import MeshFile
from meshcone.settings import load_settings
from meshcone.text import BYTE_ORDER_MARK

_ACCEPTED = (
    "OBJ, glTF, GLB, PLY, STL or OFF, alone or in a ZIP; or, to compare with, STEP, 3MF, USD or XYZ"
)
_MESHES = frozenset({".obj", ".glb", ".gltf", ".ply", ".stl", ".off", ".xyz"}) | SUFFIXES
_READABLE = _MESHES | {"", ".zip"}
_DEFAULT = ReadPolicy()
_OBJ_VERTEX = re.compile(rb"^[ \t]*v[ \t]", re.MULTILINE)
_OTHER_FORMATS = {
    b"\x1f\x8b": "a gzip archive",
    b"BZh": "a bzip2 archive",
    b"\xfd7zXZ": "an xz archive",
    b"Kaydara FBX": "an FBX file",
    b"; FBX": "an FBX file",
    b"BLENDER": "a Blender file",
    b"\x89PNG": "a PNG image",
    b"\xff\xd8\xff": "a JPEG image",
    b"%PDF": "a PDF document",
    b"<": "an XML or HTML document",
}


def read_asset(
    name: str,
    data: bytes,
    resources: Mapping[str, bytes] | None = None,
    limits: Limits | None = None,
    policy: ReadPolicy = _DEFAULT,
) -> Asset:
    """Read a mesh file.

    Args:
        name: the file's name; never opened, used for its suffix and in messages.
        data: the file's bytes.
        resources: the files a glTF names, by the names it uses for them.
        limits: caps on sizes; by default those of the environment.
        policy: what of the file is read.

    Raises:
        InputError: the file is not a mesh, is damaged, or uses what is not supported,
            and ``place`` says where; or a cap in the environment is no number.
        LimitError: the file is larger or deeper than ``limits`` accept.
    """
    limits = limits or load_settings(Limits)
    resources = resources or {}
    with naming(name):
        total = len(data) + sum(map(len, resources.values()))
        limits.check("file_bytes", total, "bytes")
        file = MeshFile(name, data, resources)
        if is_archive(data):
            directory = read_directory(data, limits)
            if recognise_package(directory) is None:
                return _read_archive(file, directory, limits, policy)
        _require_archive(policy)
        return _dispatch(file, limits, policy).read_from(file)


def _read_archive(
    file: MeshFile, directory: Directory, limits: Limits, policy: ReadPolicy
) -> Asset:
    required = "member" not in policy.inherited
    packed = unpack(file.data, directory, _MESHES, policy.member, required=required)
    mesh = replace(packed.mesh, resources={**file.resources, **packed.mesh.resources})
    with naming(f"{file.name}/{mesh.name}"):
        asset = _dispatch(mesh, limits, policy)
    asset.name = file.name
    return asset.read_from(mesh, packed)


def _require_archive(policy: ReadPolicy) -> None:
    if policy.member is not None and "member" not in policy.inherited:
        raise InputError(
            f"option 'member' names '{policy.member[:200]}' in an archive, but the file is not an "
            "archive"
        )


def _require_choice(policy: ReadPolicy) -> None:
    """Refuse to read as it is a file of another format than one that has scenes."""
    if policy.lod > 0:
        raise InputError(
            "option 'lod': only a glTF has levels of detail, and this file is not a glTF"
        )
    if policy.scene not in (None, ALL_SCENES) and "scene" not in policy.inherited:
        raise InputError("option 'scene': only a glTF has scenes, and this is not a glTF")


def _dispatch(file: MeshFile, limits: Limits, policy: ReadPolicy) -> Asset:
    name, data, resources = file.name, file.data, file.resources
    refuse_pointer(data)
    if not data.strip(b"\x00 \t\r\n"):
        raise InputError(f"the file is empty{_other_kind(name)}; expected {_ACCEPTED}")
    if data.startswith(b"glTF"):
        return read_glb(name, data, resources, limits, policy)
    start = data[:4096].removeprefix(BYTE_ORDER_MARK).lstrip()
    if start.startswith(b"{"):
        return read_gltf(name, data, resources, limits, policy)
    _require_choice(policy)
    if converted := _converted(data, limits):
        return read_converted(name, converted, data, limits, policy)
    suffix = _suffix(name)
    if foreign := recognise_foreign(suffix, data):
        return read_foreign(name, foreign, data, limits)
    for signature, kind in _OTHER_FORMATS.items():
        if start.startswith(signature):
            raise InputError(f"this is {kind}; expected {_ACCEPTED}")
    if suffix == ".xyz":
        return PointAsset(name, "xyz", *read_xyz(data.removeprefix(BYTE_ORDER_MARK), limits))
    if suffix in {".glb", ".gltf"} and not _is_obj(data):
        expected = "'glTF'" if suffix == ".glb" else "a JSON object"
        raise InputError(f"the file does not start with {expected}", place="byte 0")
    if suffix not in {".obj", ".glb", ".gltf"} and not _OBJ_VERTEX.search(data):
        raise InputError(f"this is not a known kind of mesh file; expected {_ACCEPTED}")
    return read_obj(name, data, resources, limits)


def _converted(data: bytes, limits: Limits) -> Converted | None:
    if not is_archive(data):
        return recognise_converted(data)
    package = recognise_package(read_directory(data, limits))
    if package is None:
        raise InputError("this is an archive within an archive; expected the mesh itself")
    return package


def _is_obj(data: bytes) -> bool:
    """Whether a file is an OBJ whatever it is called: text with a vertex on some line."""
    return b"\x00" not in data[:4096] and _OBJ_VERTEX.search(data) is not None


def _suffix(name: str) -> str:
    return PurePosixPath(name.replace("\\", "/")).suffix.lower()


def _other_kind(name: str) -> str:
    """That a file would be of no use with something in it either."""
    suffix = _suffix(name)
    return "" if suffix in _READABLE else f", and files named '{suffix}' are not read here"
