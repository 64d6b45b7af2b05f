"""The triangles of mesh primitives (glTF 2.0, section 3.7.2)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.gltf.accessors import Accessor, Accessors
from meshcone.assets.gltf.document import Document
from meshcone.assets.gltf.element import Element
from meshcone.assets.gltf.extensions import QUANTIZATION
from meshcone.assets.limits import Limits

_TRIANGLES, _STRIP, _FAN = 4, 5, 6
_INFLUENCE_SETS = 2  # viewers read one set of four, some two


@dataclass(frozen=True)
class Primitive:
    """Triangles over the vertices of one POSITION accessor.

    Attributes:
        triangles: (k, 3) indices into the accessor, counter-clockwise.
        joints, weights: which joints each vertex follows and how much, four in each pair.
        targets: what each morph target adds to the positions, if it does.
    """

    element: Element
    position: Accessor
    normal: Accessor | None
    tangent: Accessor | None
    material: int | None
    triangles: NDArray[np.int64]
    joints: tuple[Accessor, ...]
    weights: tuple[Accessor, ...]
    targets: tuple[Accessor | None, ...]


class PrimitiveReader:
    """Reads primitives of one document.

    Attributes:
        empty: those that draw nothing, for lack of vertices or indices.
        ragged: those with indices left over that make no whole triangle.
    """

    def __init__(self, document: Document, accessors: Accessors, limits: Limits) -> None:
        self._accessors = accessors
        self._limits = limits
        self._quantized = document.uses(QUANTIZATION)
        self._triangles_read = 0
        self.empty: list[Element] = []
        self.ragged: list[Element] = []

    def read(self, element: Element) -> Primitive | None:
        """One primitive; None if it draws points, lines or nothing.

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
        if position.count == 0:
            self.empty.append(element)
            return None
        normal = self._attribute(attributes, "NORMAL", "VEC3", position)
        triangles = self._triangles(element, mode, position)
        if len(triangles) == 0:
            self.empty.append(element)
            return None
        joints, weights = self._influences(attributes, position)
        return Primitive(
            element=element,
            position=position,
            normal=normal,
            tangent=self._attribute(attributes, "TANGENT", "VEC4", position) if normal else None,
            material=element.integer("material"),
            triangles=triangles,
            joints=joints,
            weights=weights,
            targets=self._targets(element, position),
        )

    def _influences(
        self, attributes: Element, position: Accessor
    ) -> tuple[tuple[Accessor, ...], tuple[Accessor, ...]]:
        joints, weights = [], []
        for number in range(_INFLUENCE_SETS):
            found = [
                self._influence(attributes, f"{name}_{number}", position)
                for name in ("JOINTS", "WEIGHTS")
            ]
            if found[0] is None or found[1] is None:
                break
            joints.append(found[0])
            weights.append(found[1])
        return tuple(joints), tuple(weights)

    def _influence(self, attributes: Element, name: str, position: Accessor) -> Accessor | None:
        index = attributes.reference(name, len(self._accessors.elements), "accessor")
        if index is None:
            return None
        accessor = self._accessors.describe(index)
        joints = name.startswith("JOINTS")
        kinds = "u" if joints else "uf"
        if accessor.kind != "VEC4" or accessor.component.kind not in kinds:
            raise accessor.element.error("type", f"{name} must be VEC4 of another type")
        if accessor.count != position.count:
            raise accessor.element.error(
                "count", f"{accessor.count} of {name} for {position.count} positions"
            )
        return accessor

    def _targets(self, element: Element, position: Accessor) -> tuple[Accessor | None, ...]:
        return tuple(
            self._attribute(target, "POSITION", "VEC3", position)
            for target in element.children("targets")
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
            count = self._whole(element, position.element, mode, position.count)
            return _assemble(mode, np.arange(count, dtype=np.int64))
        accessor = self._accessors.describe(index)
        if accessor.kind != "SCALAR" or accessor.component.kind != "u":
            raise accessor.element.error("componentType", "indices must be unsigned scalars")
        count = self._whole(element, accessor.element, mode, accessor.count)
        indices = self._accessors.read(accessor)[:count, 0].astype(np.int64)
        if count and indices.max() >= position.count:
            raise element.error("indices", f"names vertex {indices.max()} of only {position.count}")
        return _assemble(mode, indices)

    def _whole(self, primitive: Element, counted: Element, mode: int, count: int) -> int:
        """How many of so many indices make whole triangles."""
        triangles = count // 3 if mode == _TRIANGLES else max(count - 2, 0)
        # Summed, since any number of primitives may read the same indices.
        self._triangles_read += triangles
        self._limits.check("faces", self._triangles_read, "triangles", counted.place("count"))
        if triangles and mode == _TRIANGLES and count % 3:
            self.ragged.append(primitive)
        if triangles == 0:
            return 0
        return 3 * triangles if mode == _TRIANGLES else count


def _assemble(mode: int, indices: NDArray[np.int64]) -> NDArray[np.int64]:
    """(k, 3) triangles from an index sequence (section 3.7.2.1).

    A strip repeats an index to turn or to jump; what that makes is no triangle.
    """
    if mode == _TRIANGLES or len(indices) == 0:
        return indices.reshape(-1, 3)
    first = np.arange(len(indices) - 2)
    if mode == _FAN:
        corners = np.stack([first + 1, first + 2, np.zeros_like(first)], axis=1)
    else:
        odd = first % 2
        corners = np.stack([first, first + 1 + odd, first + 2 - odd], axis=1)
    a, b, c = indices[corners].T
    whole: NDArray[np.int64] = indices[corners][(a != b) & (b != c) & (c != a)]
    return whole
