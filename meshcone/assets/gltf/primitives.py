"""The triangles of mesh primitives (glTF 2.0, section 3.7.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.gltf.accessors import Accessor, Accessors
from meshcone.assets.gltf.document import DRACO, QUANTIZATION, Document
from meshcone.assets.gltf.element import Element
from meshcone.assets.limits import Limits
from meshcone.errors import InputError

_TRIANGLES, _STRIP, _FAN = 4, 5, 6


@dataclass(frozen=True)
class Primitive:
    """Triangles over the vertices of one POSITION accessor.

    Attributes:
        triangles: (k, 3) indices into the accessor, counter-clockwise.
        compressed: whether the positions are also stored in a compressed copy.
    """

    element: Element
    position: Accessor
    normal: Accessor | None
    tangent: Accessor | None
    material: int | None
    triangles: NDArray[np.int64]
    morphed: bool
    compressed: bool


class PrimitiveReader:
    """Reads primitives of one document."""

    def __init__(self, document: Document, accessors: Accessors, limits: Limits) -> None:
        self._accessors = accessors
        self._limits = limits
        self._quantized = document.uses(QUANTIZATION)
        self._triangles_read = 0

    def read(self, element: Element) -> Primitive | None:
        """One primitive; None if it draws points or lines or has no positions.

        Raises:
            InputError: an attribute or index is missing, of a wrong type or out of range.
            LimitError: more triangles than ``limits.faces``.
        """
        mode = element.integer("mode")
        mode = _TRIANGLES if mode is None else mode
        if mode > _FAN:
            raise element.error("mode", f"unknown primitive mode {mode}")
        attributes = element.child("attributes")
        if attributes is None:
            raise element.error("attributes", "'attributes' is missing")
        if mode < _TRIANGLES or "POSITION" not in attributes.value:
            return None
        position = self._attribute(attributes, "POSITION", "VEC3", None)
        assert position is not None  # noqa: S101 - the key was just found
        normal = self._attribute(attributes, "NORMAL", "VEC3", position)
        extensions = element.child("extensions")
        draco = extensions is not None and DRACO in extensions.value
        if draco and position.dense is None and position.sparse is None:
            raise InputError(
                f"the positions are stored in '{DRACO}' only; export without Draco compression",
                place=element.pointer,
            )
        return Primitive(
            element=element,
            position=position,
            normal=normal,
            tangent=self._attribute(attributes, "TANGENT", "VEC4", position) if normal else None,
            material=element.integer("material"),
            triangles=self._triangles(element, mode, position),
            morphed=bool(element.children("targets")),
            compressed=draco or self._accessors.is_compressed(position),
        )

    def _attribute(
        self, attributes: Element, name: str, kind: str, position: Accessor | None
    ) -> Accessor | None:
        index = attributes.reference(name, len(self._accessors.elements), "accessor")
        if index is None:
            return None
        accessor = self._accessors.describe(index)
        if accessor.kind != kind:
            raise accessor.element.error("type", f"{name} must be {kind}, found {accessor.kind}")
        if accessor.component.kind != "f" and not self._quantized:
            raise accessor.element.error(
                "componentType", f"{name} must be FLOAT without {QUANTIZATION}"
            )
        if accessor.component.itemsize == 4 and accessor.component.kind == "u":
            raise accessor.element.error("componentType", f"{name} cannot be UNSIGNED_INT")
        if position is not None and accessor.count != position.count:
            raise accessor.element.error(
                "count", f"{accessor.count} of {name} for {position.count} positions"
            )
        return accessor

    def _triangles(self, element: Element, mode: int, position: Accessor) -> NDArray[np.int64]:
        index = element.reference("indices", len(self._accessors.elements), "accessor")
        if index is None:
            self._check_count(position.element, mode, position.count)
            return _assemble(mode, np.arange(position.count, dtype=np.int64))
        accessor = self._accessors.describe(index)
        if accessor.kind != "SCALAR" or accessor.component.kind != "u":
            raise accessor.element.error("componentType", "indices must be unsigned scalars")
        self._check_count(accessor.element, mode, accessor.count)
        indices = self._accessors.read(accessor)[:, 0].astype(np.int64)
        if indices.max() >= position.count:
            raise element.error("indices", f"names vertex {indices.max()} of only {position.count}")
        return _assemble(mode, indices)

    def _check_count(self, element: Element, mode: int, count: int) -> None:
        triangles = count // 3 if mode == _TRIANGLES else count - 2
        # Summed, since any number of primitives may read the same indices.
        self._triangles_read += max(triangles, 0)
        self._limits.check("faces", self._triangles_read, "triangles", element.place("count"))
        if mode == _TRIANGLES and count % 3:
            raise element.error("count", f"{count} indices do not make whole triangles")
        if count < 3:
            raise element.error("count", f"{count} indices make no triangle")


def _assemble(mode: int, indices: NDArray[np.int64]) -> NDArray[np.int64]:
    """(k, 3) triangles from an index sequence (section 3.7.2.1)."""
    if mode == _TRIANGLES:
        return indices.reshape(-1, 3)
    first = np.arange(len(indices) - 2)
    if mode == _FAN:
        corners = np.stack([first + 1, first + 2, np.zeros_like(first)], axis=1)
    else:
        odd = first % 2
        corners = np.stack([first, first + 1 + odd, first + 2 - odd], axis=1)
    return indices[corners]


def mesh_primitives(mesh: Element) -> list[Element]:
    """The primitives of a mesh.

    Raises:
        InputError: it has none.
    """
    found = mesh.children("primitives")
    if not found:
        raise InputError("a mesh needs at least one primitive", place=mesh.pointer)
    return found
