"""Turns compressed primitives into plain ones: the same document, its accessors with buffers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.gltf.accessors import Accessor, Accessors, bounds
from meshcone.assets.gltf.apart import place_apart
from meshcone.assets.gltf.buffers import Buffers
from meshcone.assets.gltf.document import Document
from meshcone.assets.gltf.draco.decoder import DracoData, DracoMesh, decode_draco
from meshcone.assets.gltf.draft import Draft
from meshcone.assets.gltf.element import Element
from meshcone.assets.gltf.extensions import DRACO
from meshcone.assets.limits import Limits
from meshcone.errors import InputError

_TRIANGLES = 4
_ELEMENT_ARRAY_BUFFER = 34963


@dataclass(frozen=True)
class DracoPrimitive:
    """A primitive as its document compresses it.

    Attributes:
        mesh, number: which primitive of which mesh.
        view: buffer view of the bitstream.
        indices: its index accessor.
        attributes: accessor and unique id by attribute.
    """

    element: Element
    mesh: int
    number: int
    view: int
    indices: Accessor
    attributes: dict[str, tuple[Accessor, int]]

    @property
    def has_copy(self) -> bool:
        """Whether all that is compressed is stored plainly as well."""
        accessors = [self.indices, *(accessor for accessor, _ in self.attributes.values())]
        return all(accessor.dense for accessor in accessors)

    @property
    def vertices(self) -> int:
        """How many vertices are declared."""
        return self.attributes["POSITION"][0].count


def draco_primitives(document: Document, accessors: Accessors) -> list[DracoPrimitive]:
    """Every compressed primitive of a document.

    Raises:
        InputError: the extension is malformed, or used on what is no list of triangles.
    """
    return [
        _read(accessors, primitive, extension, mesh, number)
        for mesh, element in enumerate(document.root.children("meshes"))
        for number, primitive in enumerate(element.children("primitives"))
        if (extension := _extension(primitive)) is not None
    ]


def inflate(
    document: Document, buffers: Buffers, limits: Limits
) -> tuple[Document, Buffers, list[DracoPrimitive]]:
    """Decompress every primitive of a document.

    A primitive that is stored plainly as well keeps that copy, which is the more exact one.

    Raises:
        InputError: the data are damaged, or not what is declared.
        LimitError: there is more of them than ``limits`` accept.
    """
    if not _is_mentioned(document):
        return document, buffers, []
    accessors = Accessors(document, buffers, limits)
    primitives = draco_primitives(document, accessors)
    if not primitives:
        return document, buffers, []
    draft = Draft(document, buffers, limits)
    meshes = _decode(accessors, [p for p in primitives if not p.has_copy], limits)
    _Placing(draft, accessors, meshes).place_all(primitives)
    for primitive in primitives:
        _drop_extension(draft, primitive)
    for key in ("extensionsUsed", "extensionsRequired"):
        _drop_name(draft, document, key)
    return *draft.finish(), primitives


def _extension(primitive: Element) -> Element | None:
    extensions = primitive.child("extensions")
    return None if extensions is None else extensions.child(DRACO)


def _is_mentioned(document: Document) -> bool:
    return DRACO in document.text  # an extension that is used need not be listed to be read


def _read(
    accessors: Accessors,
    primitive: Element,
    extension: Element,
    mesh: int,
    number: int,
) -> DracoPrimitive:
    mode = primitive.integer("mode")
    if mode not in (None, _TRIANGLES):
        raise primitive.error("mode", f"'{DRACO}' is supported for lists of triangles only")
    count = len(accessors.elements)
    view = extension.reference("bufferView", len(accessors.views), "buffer view")
    indices = primitive.reference("indices", count, "accessor")
    stored, declared = extension.child("attributes"), primitive.child("attributes")
    if view is None or indices is None or stored is None or declared is None:
        missing = "bufferView, attributes and the primitive's indices"
        raise InputError(f"'{DRACO}' needs {missing}", place=extension.pointer)
    attributes = {}
    for name in stored.value:
        index = declared.reference(name, count, "accessor")
        if index is None:
            raise stored.error(name, f"compresses '{name[:40]}', which the primitive has not")
        attributes[name] = (accessors.describe(index), stored.required_integer(name))
    if "POSITION" not in attributes:
        raise InputError(f"'{DRACO}' without POSITION is not supported", place=stored.pointer)
    found = DracoPrimitive(primitive, mesh, number, view, accessors.describe(indices), attributes)
    for name, (accessor, _) in attributes.items():
        if accessor.sparse and not found.has_copy:
            raise accessor.element.error("sparse", f"is not supported together with '{DRACO}'")
        if accessor.count != found.vertices:
            raise accessor.element.error(
                "count", f"{accessor.count:,} of {name} for {found.vertices:,} positions"
            )
    return found


def _decode(
    accessors: Accessors, primitives: list[DracoPrimitive], limits: Limits
) -> dict[int, DracoMesh]:
    """Meshes by buffer view."""
    blobs: dict[int, DracoData] = {}
    vertices = triangles = size = 0
    for primitive in primitives:
        if primitive.view in blobs:
            continue
        start, length, buffer = accessors.view_extent(primitive.view)
        blob = DracoData(
            data=accessors.buffers[buffer].data[start : start + length],
            triangles=primitive.indices.count // 3,
            vertices=primitive.vertices,
            size=sum(accessor.size for accessor in _accessors(primitive)),
            place=primitive.element.pointer,
        )
        blobs[primitive.view] = blob
        vertices, triangles = vertices + blob.vertices, triangles + blob.triangles
        size += blob.size
        place = primitive.element.pointer
        limits.check("meshes", len(blobs), "compressed primitives", place)
        limits.check("vertices", vertices, "compressed vertices", place)
        limits.check("faces", triangles, "compressed triangles", place)
        limits.check("file_bytes", size, "bytes when decompressed", place)
    return dict(zip(blobs, decode_draco(list(blobs.values())), strict=True))


def _accessors(primitive: DracoPrimitive) -> Iterator[Accessor]:
    yield primitive.indices
    for accessor, _ in primitive.attributes.values():
        yield accessor


class _Placing:
    """Puts decoded arrays where accessors find them."""

    def __init__(self, draft: Draft, accessors: Accessors, meshes: dict[int, DracoMesh]) -> None:
        self._draft = draft
        self._accessors = accessors
        self._meshes = meshes
        self._sources: dict[int, tuple[int, str | int]] = {}
        self._placed: set[int] = set()
        self._index_accessors: dict[int, int] = {}

    def place_all(self, primitives: list[DracoPrimitive]) -> None:
        """Place what no plain copy exists of."""
        for primitive in primitives:
            if primitive.has_copy:
                continue
            mesh = self._meshes[primitive.view]
            if self._is_new(primitive.indices, primitive.view, "indices", primitive):
                self._place_indices(primitive, mesh)
            for name, (accessor, identifier) in primitive.attributes.items():
                values = mesh.attributes.get(identifier)
                if values is None:
                    raise primitive.element.error(
                        "extensions", f"the Draco data have no attribute {identifier} ({name[:40]})"
                    )
                if not self._is_new(accessor, primitive.view, identifier, primitive):
                    continue
                stored = _as_declared(values, accessor)
                place_apart(
                    self._draft,
                    accessor,
                    stored,
                    self._buffer(primitive),
                    _bounds(accessor, stored),
                )

    def _is_new(
        self, accessor: Accessor, view: int, what: str | int, primitive: DracoPrimitive
    ) -> bool:
        known = self._sources.setdefault(accessor.index, (view, what))
        indices = self._index_accessors.setdefault(view, primitive.indices.index)
        agree = known == (view, what) or self._are_equal(known, (view, what))
        if not agree or indices != primitive.indices.index:
            raise primitive.element.error(
                "extensions", f"accessor {accessor.index} is decompressed from two sources"
            )
        new = accessor.index not in self._placed
        self._placed.add(accessor.index)
        return new

    def _are_equal(self, one: tuple[int, str | int], other: tuple[int, str | int]) -> bool:
        """Whether two attributes hold the same: so encoders store UV sets of one accessor."""
        (view, what), (other_view, other_what) = one, other
        if isinstance(what, str) or isinstance(other_what, str):
            return False
        values = self._meshes[view].attributes.get(what)
        others = self._meshes[other_view].attributes.get(other_what)
        return values is not None and others is not None and np.array_equal(values, others)

    def _buffer(self, primitive: DracoPrimitive) -> int:
        return self._accessors.view_extent(primitive.view)[2]

    def _place_indices(self, primitive: DracoPrimitive, mesh: DracoMesh) -> None:
        accessor, view = primitive.indices, primitive.view
        if accessor.kind != "SCALAR" or accessor.component.kind != "u":
            raise accessor.element.error("componentType", "indices must be unsigned scalars")
        stored = _as_declared(mesh.faces.reshape(-1, 1), accessor)
        self._draft.replace(view, stored.tobytes())
        self._draft.put(("bufferViews", view, "target"), _ELEMENT_ARRAY_BUFFER)
        if "byteStride" in self._accessors.views[view].value:
            self._draft.remove(("bufferViews", view, "byteStride"))
        path = ("accessors", accessor.index)
        self._draft.put((*path, "bufferView"), view)
        for key, bound in _bounds(accessor, stored).items():
            self._draft.put((*path, key), bound)
        for key in ("byteOffset", "sparse"):
            if key in accessor.element.value:
                self._draft.remove((*path, key))


def _as_declared(values: NDArray[Any], accessor: Accessor) -> NDArray[Any]:
    """Decoded components in the type the accessor declares."""
    table = values.reshape(len(values), -1)
    if table.shape != (accessor.count, accessor.columns):
        found, declared = table.shape, (accessor.count, accessor.columns)
        raise accessor.element.error(
            "count",
            f"declares {declared[0]:,} × {declared[1]} components, "  # noqa: RUF001
            f"the Draco data hold {found[0]:,} × {found[1]}",  # noqa: RUF001
        )
    with np.errstate(invalid="ignore", over="ignore"):
        stored = table.astype(accessor.component)
    if accessor.component.kind != "f" and not np.array_equal(stored, table):
        raise accessor.element.error("componentType", "decompressed values do not fit")
    return stored


def _bounds(accessor: Accessor, stored: NDArray[Any]) -> dict[str, Any]:
    """Minima and maxima, where declared: decompressing does not quite restore the original."""
    return {key: bound for key, bound in bounds(stored).items() if key in accessor.element.value}


def _drop_extension(draft: Draft, primitive: DracoPrimitive) -> None:
    path = ("meshes", primitive.mesh, "primitives", primitive.number, "extensions")
    only = len(primitive.element.value["extensions"]) == 1
    draft.remove(path if only else (*path, DRACO))


def _drop_name(draft: Draft, document: Document, key: str) -> None:
    names = document.root.texts(key)
    if DRACO not in names:
        return
    kept = [name for name in names if name != DRACO]
    if kept:
        draft.put((key,), kept)
    else:
        draft.remove((key,))
