"""Where skins and morph targets show vertices at rest (glTF 2.0, sections 3.7.2.2 and 3.7.3)."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.gltf.accessors import Accessor, Accessors, decode
from meshcone.assets.gltf.document import Document
from meshcone.assets.gltf.element import Element
from meshcone.assets.gltf.nodes import Placement, local_matrix
from meshcone.assets.gltf.pose import Pose, blended
from meshcone.assets.gltf.primitives import Primitive
from meshcone.assets.limits import Limits

_SHIFTS_PER_VERTEX = 8  # morph targets in use, on average, before they count as hostile


class PoseReader:
    """Reads the poses of one document's meshes.

    Args:
        document: it.
        accessors: its accessors.
        limits: those it is read under.
        worlds: (4, 4) matrix to world space of each node of the scene.
    """

    def __init__(
        self,
        document: Document,
        accessors: Accessors,
        limits: Limits,
        worlds: Mapping[int, NDArray[np.float64]],
    ) -> None:
        self._accessors = accessors
        self._limits = limits
        self._worlds = dict(worlds)
        self._nodes = document.root.children("nodes")
        self._meshes = document.root.children("meshes")
        self._skins = document.root.children("skins")
        self._bones: dict[int, NDArray[np.float64]] = {}
        self._bound = 0  # joints, or matrices for them
        self._weights: dict[str, dict[int, float]] = {}
        self._above: dict[int, int] | None = None
        self._shifted = 0

    def deformers(self, placement: Placement, primitive: Primitive) -> list[Accessor | None]:
        """The accessors that decide where a primitive is shown, besides its positions."""
        used: list[Accessor | None] = []
        if placement.skinned:
            used += (*primitive.joints, *primitive.weights)
        if self._weighted(placement, primitive):
            used += primitive.targets
        return used

    def pose(self, placement: Placement, primitive: Primitive) -> Pose:
        """Where a viewer shows a primitive.

        Raises:
            InputError: skin, joints, weights or targets are malformed.
            LimitError: more morph targets are in use than ``limits`` accept.
        """
        shift = self._shift(placement, primitive)
        skin = self._nodes[placement.node].reference("skin", len(self._skins), "skin")
        if skin is None or not primitive.joints:
            return Pose.rigid(placement.matrix, shift)
        bones = self._bones_of(skin)
        joints = np.concatenate([self._accessors.read(each) for each in primitive.joints], axis=1)
        weights = np.concatenate([self._values(each) for each in primitive.weights], axis=1)
        # A joint that the skin does not have moves nothing, nor does a weight that is no number.
        usable = (joints < len(bones)) & np.isfinite(weights)
        joints = np.where(usable, joints, 0).astype(np.int64)
        return Pose(blended(bones, joints, np.where(usable, weights, 0.0)), shift)

    def _shift(self, placement: Placement, primitive: Primitive) -> NDArray[np.float64] | None:
        shift = None
        for weight, target in self._weighted(placement, primitive):
            self._shifted += target.count
            place = primitive.element.place("targets")
            count = self._shifted // _SHIFTS_PER_VERTEX
            self._limits.check("vertices", count, "vertices moved by morph targets, over 8", place)
            added = weight * self._values(target)
            shift = added if shift is None else shift + added
        return shift

    def _weighted(self, placement: Placement, primitive: Primitive) -> list[tuple[float, Accessor]]:
        """The targets that add something, each with its weight; a weight of no target adds none."""
        weights = self._default_weights(placement)
        return [
            (weights[number], target)
            for number, target in enumerate(primitive.targets if weights else ())
            if target is not None and number in weights
        ]

    def _default_weights(self, placement: Placement) -> dict[int, float]:
        """Of the morph targets, those that are not zero: the node's, or else the mesh's."""
        for element in (self._nodes[placement.node], self._meshes[placement.mesh]):
            stated = element.value.get("weights")
            if stated is not None:
                # Any number of primitives and nodes may share a list of any length.
                if element.pointer not in self._weights:
                    length = len(stated) if isinstance(stated, list) else 0
                    found = enumerate(element.numbers("weights", length) or [])
                    self._weights[element.pointer] = {
                        number: weight for number, weight in found if weight != 0
                    }
                return self._weights[element.pointer]
        return {}

    def _values(self, accessor: Accessor) -> NDArray[np.float64]:
        return decode(self._accessors.read(accessor), accessor.normalized)

    def _bones_of(self, skin: int) -> NDArray[np.float64]:
        """(j, 4, 4) from the mesh in its bind pose to world, for each joint."""
        if skin not in self._bones:
            element = self._skins[skin]
            joints = element.references("joints", len(self._nodes), "node")
            if not joints:
                raise element.error("joints", "a skin needs at least one joint")
            inverses = self._inverse_binds(element, len(joints))
            with np.errstate(over="ignore", invalid="ignore"):
                bones = np.stack([self._world(joint) for joint in joints]) @ inverses
            if not np.isfinite(bones).all():
                raise element.error("joints", "the transform of a joint overflows")
            self._bones[skin] = bones
        return self._bones[skin]

    def _inverse_binds(self, skin: Element, joints: int) -> NDArray[np.float64]:
        count = len(self._accessors.elements)
        index = skin.reference("inverseBindMatrices", count, "accessor")
        accessor = None if index is None else self._accessors.describe(index)
        # Summed, since any number of skins may have the same joints and read the same matrices.
        self._bound += joints if accessor is None else max(joints, accessor.count)
        what = "joints of skins, or matrices to bind them"
        self._limits.check("vertices", self._bound, what, skin.pointer)
        if accessor is None:
            return np.broadcast_to(np.eye(4), (joints, 4, 4))
        if accessor.kind != "MAT4" or accessor.component.kind != "f" or accessor.count < joints:
            raise skin.error(
                "inverseBindMatrices",
                f"expected {joints} MAT4 of FLOAT, found {accessor.count} {accessor.kind}",
            )
        found = self._values(accessor)[:joints].reshape(joints, 4, 4).transpose(0, 2, 1).copy()
        if not np.isfinite(found).all():
            raise skin.error("inverseBindMatrices", "expected finite numbers, found others")
        found[:, 3] = (0, 0, 0, 1)
        return found

    def _world(self, node: int) -> NDArray[np.float64]:
        """Of a joint, which may be in no scene at all."""
        above: list[int] = []
        here: int | None = node
        while here is not None and here not in self._worlds:
            above.append(here)
            place = self._nodes[here].pointer
            self._limits.check("node_depth", len(above), "levels of nodes", place)
            here = self._parents().get(here)
        matrix = np.eye(4) if here is None else self._worlds[here]
        for each in reversed(above):
            matrix = matrix @ local_matrix(self._nodes[each])
            self._worlds[each] = matrix
        return matrix

    def _parents(self) -> dict[int, int]:
        if self._above is None:
            count = len(self._nodes)
            self._above = {
                child: parent
                for parent, node in enumerate(self._nodes)
                for child in node.references("children", count, "node")
            }
        return self._above
