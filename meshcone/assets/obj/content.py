"""What an OBJ file and its material libraries hold besides the surface.

An object is a node and a mesh, what of it has one material a primitive. A file without objects
is divided by its groups, as viewers do.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import takewhile

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.content import Attribute, Content, Draw, Material, Mesh, Node, Primitive
from meshcone.assets.content.faults import Faults
from meshcone.assets.obj.materials import LibraryReader
from meshcone.assets.obj.numbers import (
    has_colors,
    read_colors,
    read_normals,
    read_texcoords,
)
from meshcone.assets.obj.scan import ObjLines
from meshcone.assets.weld import group_equal_rows
from meshcone.srgb import to_linear
from meshcone.text import words_of

_Read = Callable[[NDArray[np.int64]], NDArray[np.float64]]

_FLOAT = 4  # bytes
_WIDTHS = {"TEXCOORD_0": 2, "NORMAL": 3, "COLOR_0": 3}
_SHORT_INDICES = 65_535  # vertices that 16 bits can number (glTF 2.0, section 3.7.2.1)


@dataclass(frozen=True)
class ObjTriangles:
    """The triangles of a file, as rows of its statements.

    Attributes:
        statements: (k,) the f statement of each.
        vertices, texcoords, normals: (k, 3) v, vt and vn statement at each corner, from 0; -1
            where there is none.
    """

    statements: NDArray[np.int64]
    vertices: NDArray[np.int64]
    texcoords: NDArray[np.int64]
    normals: NDArray[np.int64]


def read_content(
    lines: ObjLines, triangles: ObjTriangles, resources: Mapping[str, bytes]
) -> Content:
    """Describe a file whose faces have been read.

    Args:
        lines: its statements.
        triangles: what it draws.
        resources: files that were sent with it, by name.
    """
    faults = Faults()
    library = LibraryReader(resources, faults)
    libraries, defined = _libraries(lines, library)
    labels = _in_force(lines, triangles.statements)
    names = [*defined, *(name for name in labels.materials if name and name not in defined)]
    materials = [defined.get(name, Material(name, defined=False)) for name in names]
    numbers = {name: number for number, name in enumerate(names)}
    draws, meshes = _draws(lines, triangles, labels, numbers)
    return Content(
        nodes=tuple(Node(mesh.name, None, 1, np.eye(4), mesh=i) for i, mesh in enumerate(meshes)),
        meshes=meshes,
        draws=draws,
        materials=tuple(materials),
        images=tuple(library.images),
        textures=sum(len(material.textures) for material in materials),
        libraries=libraries,
        extras=_groups(lines),
        faults=faults.found(),
    )


def _groups(lines: ObjLines) -> dict[str, str]:
    """Groups of a file whose meshes are its objects: they are names alone."""
    names = lines.names(lines.groups) if len(lines.objects) else []
    return {f"group {name}": name for name in names if name}


@dataclass(frozen=True)
class _Labels:
    """Which object and material each triangle is in.

    Attributes:
        objects, materials: numbers by name; the empty name stands for none.
        rows: (k, 2) the numbers of each triangle.
    """

    objects: dict[str, int]
    materials: dict[str, int]
    rows: NDArray[np.int64]


def _in_force(lines: ObjLines, statements: NDArray[np.int64]) -> _Labels:
    divided_by = lines.objects if len(lines.objects) else lines.groups
    columns, named = [], []
    for markers in (divided_by, lines.materials):
        names = ["", *lines.names(markers)]  # nothing is in force before the first of them
        numbers = {name: number for number, name in enumerate(dict.fromkeys(names))}
        in_force = np.array([numbers[name] for name in names])
        columns.append(in_force[np.searchsorted(markers, statements)])
        named.append(numbers)
    return _Labels(named[0], named[1], np.stack(columns, axis=1))


def _libraries(
    lines: ObjLines, reader: LibraryReader
) -> tuple[dict[str, bool], dict[str, Material]]:
    """Whether each library was sent, and the materials they define; the first of a name counts."""
    found: dict[str, bool] = {}
    materials: dict[str, Material] = {}
    for statement in lines.names(lines.libraries):
        for name in _library_names(statement, reader):
            if name in found:
                continue
            data = reader.find(name)
            found[name] = data is not None
            for material in reader.read(name, data) if data is not None else ():
                materials.setdefault(material.name, material)
    return found, materials


def _library_names(statement: str, reader: LibraryReader) -> list[str]:
    """The libraries of a statement, which may name several, or one with blanks in it.

    A number sign is of a name or begins a comment: what was sent decides.
    """
    for whole in (statement, statement.partition("#")[0].rstrip(" \t")):
        if whole and reader.find(whole) is not None:
            return [whole]
    words = words_of(statement)
    return list(takewhile(lambda word: not word.startswith("#"), words))


def _draws(
    lines: ObjLines, triangles: ObjTriangles, labels: _Labels, materials: Mapping[str, int]
) -> tuple[tuple[Draw, ...], tuple[Mesh, ...]]:
    parts, firsts = group_equal_rows(labels.rows.astype(np.float64))
    order = np.argsort(parts, kind="stable")
    bounds = np.searchsorted(parts[order], np.arange(len(firsts) + 1))
    object_names, material_names = list(labels.objects), list(labels.materials)
    meshes: dict[int, int] = {}
    primitives: list[list[Primitive]] = []
    draws = []
    tables = _Tables(lines, triangles)
    for part, (owner, material) in enumerate(labels.rows[firsts].tolist()):
        rows = np.sort(order[bounds[part] : bounds[part + 1]])
        mesh = meshes.setdefault(owner, len(meshes))
        if mesh == len(primitives):
            primitives.append([])
        attributes = tables.attributes(rows)
        number = materials.get(material_names[material])
        draws.append(Draw(mesh, mesh, len(primitives[mesh]), number, rows, attributes))
        primitives[mesh].append(_primitive(triangles, rows, number, tuple(attributes)))
    found = tuple(
        Mesh(object_names[owner], tuple(primitives[mesh])) for owner, mesh in meshes.items()
    )
    return tuple(draws), found


def _primitive(
    triangles: ObjTriangles, rows: NDArray[np.int64], material: int | None, names: tuple[str, ...]
) -> Primitive:
    """Triangles as a GPU needs them: a vertex for each combination that a corner has."""
    corners = [triangles.vertices[rows], triangles.texcoords[rows], triangles.normals[rows]]
    combined, _ = group_equal_rows(np.stack(corners, axis=-1).reshape(-1, 3).astype(np.float64))
    vertices = int(combined.max()) + 1
    vertex_bytes = _FLOAT * (3 + sum(_WIDTHS[name] for name in names))
    index_bytes = 2 if vertices <= _SHORT_INDICES else 4
    return Primitive(
        material=material,
        mode="triangles",
        vertices=vertices,
        attributes=tuple(sorted(("POSITION", *names))),
        gpu_bytes={-1: vertices * vertex_bytes + len(combined) * index_bytes},
    )


class _Tables:
    """The values that corners name, each table read when it is first asked for."""

    def __init__(self, lines: ObjLines, triangles: ObjTriangles) -> None:
        self._lines = lines
        self._corners = {"TEXCOORD_0": triangles.texcoords, "NORMAL": triangles.normals}
        if has_colors(lines):
            self._corners["COLOR_0"] = triangles.vertices

    def attributes(self, rows: NDArray[np.int64]) -> dict[str, Attribute]:
        """What some triangles have."""
        return {
            name: Attribute(name, corners[rows], self._readers[name], stored=self._stored.get(name))
            for name, corners in self._corners.items()
            if (corners[rows] >= 0).any()
        }

    @cached_property
    def _readers(self) -> dict[str, _Read]:
        return {
            "TEXCOORD_0": lambda rows: self._texcoords[rows],
            "NORMAL": lambda rows: self._normals[rows],
            # As tools write them they are sRGB; in glTF, whose words these are, they are linear.
            "COLOR_0": lambda rows: to_linear(self._colors[rows]),
        }

    @cached_property
    def _stored(self) -> dict[str, _Read]:
        return {"COLOR_0": lambda rows: self._colors[rows]}

    @cached_property
    def _texcoords(self) -> NDArray[np.float64]:
        # v runs upwards in OBJ, downwards in glTF.
        return read_texcoords(self._lines) * (1.0, -1.0) + (0.0, 1.0)

    @cached_property
    def _normals(self) -> NDArray[np.float64]:
        return read_normals(self._lines)

    @cached_property
    def _colors(self) -> NDArray[np.float64]:
        return read_colors(self._lines)
