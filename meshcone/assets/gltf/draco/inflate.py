"""Turns compressed primitives into plain ones: the same document, its accessors with buffers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.gltf.accessors import Accessor, Accessors, bounds
from meshcone.assets.gltf.apart import place_apart
from meshcone.assets.gltf.buffers import Buffers
from meshcone.assets.gltf.document import Document
from meshcone.assets.gltf.draco.decoder import DracoData, DracoMesh, decode_draco
from meshcone.assets.gltf.draco.primitives import DracoPrimitive, draco_primitives, separated
from meshcone.assets.gltf.draft import Draft
from meshcone.assets.gltf.extensions import DRACO
from meshcone.assets.limits import Limits

_ELEMENT_ARRAY_BUFFER = 34963


@dataclass(frozen=True)
class Inflated:
    """A document and its plain form.

    Attributes:
        compressed: the document, with accessors of its own for each bitstream.
        plain: the document without compressed primitives; its accessors have the same indices.
        buffers: of the plain document.
        primitives: what is compressed.
        miscounted: accessors that declare another number of elements than they have.
    """

    compressed: Document
    plain: Document
    buffers: Buffers
    primitives: list[DracoPrimitive]
    miscounted: tuple[Accessor, ...]


def inflate(document: Document, buffers: Buffers, limits: Limits) -> Inflated | None:
    """Decompress every primitive of a document.

    A primitive that is stored plainly as well keeps that copy, which is the more exact one.
    Where an accessor declares another count than the data hold, the data count, as for viewers:
    compressing splits vertices at seams and drops faces without area, and some exporters do not
    count again.

    Returns:
        None where nothing is compressed.

    Raises:
        InputError: the data are damaged, or not what is declared.
        LimitError: there is more of them than ``limits`` accept.
    """
    if not _is_mentioned(document):
        return None
    document = separated(document, buffers, limits)
    accessors = Accessors(document, buffers, limits)
    primitives = draco_primitives(document, accessors)
    if not primitives:
        return None
    draft = Draft(document, buffers, limits)
    meshes = _decode(accessors, [p for p in primitives if not p.has_copy], limits)
    placing = _Placing(draft, accessors, meshes)
    placing.place_all(primitives)
    for primitive in primitives:
        _drop_extension(draft, primitive)
    for key in ("extensionsUsed", "extensionsRequired"):
        _drop_name(draft, document, key)
    return Inflated(document, *draft.finish(), primitives, tuple(placing.miscounted))


def _is_mentioned(document: Document) -> bool:
    return DRACO in document.text  # an extension that is used need not be listed to be read


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
            size=sum(accessor.size for _, accessor in primitive.filled()),
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
    meshes = dict(zip(blobs, decode_draco(list(blobs.values())), strict=True))
    # Data may hold more than is declared.
    limits.check("vertices", sum(mesh.vertices for mesh in meshes.values()), "compressed vertices")
    return meshes


class _Placing:
    """Puts decoded arrays where accessors find them.

    Attributes:
        miscounted: accessors that declare another number of elements.
    """

    def __init__(self, draft: Draft, accessors: Accessors, meshes: dict[int, DracoMesh]) -> None:
        self._draft = draft
        self._accessors = accessors
        self._meshes = meshes
        self._sources: dict[int, tuple[int, str | int]] = {}
        self._placed: set[int] = set()
        self.miscounted: list[Accessor] = []

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
                buffer = self._accessors.view_extent(primitive.view)[2]
                declared = self._declared(accessor, stored)
                place_apart(self._draft, accessor, stored, buffer, declared)

    def _is_new(
        self, accessor: Accessor, view: int, what: str | int, primitive: DracoPrimitive
    ) -> bool:
        known = self._sources.setdefault(accessor.index, (view, what))
        if known != (view, what) and not self._are_equal(known, (view, what)):
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
        for key, value in self._declared(accessor, stored).items():
            self._draft.put((*path, key), value)
        for key in ("byteOffset", "sparse"):
            if key in accessor.element.value:
                self._draft.remove((*path, key))

    def _declared(self, accessor: Accessor, stored: NDArray[Any]) -> dict[str, Any]:
        """What an accessor declares of its elements, as they are."""
        declared = _bounds(accessor, stored)
        if len(stored) != accessor.count:
            self.miscounted.append(accessor)
            declared["count"] = len(stored)
        return declared


def _as_declared(values: NDArray[Any], accessor: Accessor) -> NDArray[Any]:
    """Decoded components in the type the accessor declares."""
    table = values.reshape(len(values), -1)
    columns = table.shape[1]
    if columns != accessor.columns:
        raise accessor.element.error(
            "type",
            f"declares {accessor.columns} components of an element, the Draco data hold {columns}",
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
