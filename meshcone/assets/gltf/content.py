"""What a glTF holds besides its surface (glTF 2.0, sections 3.5 to 3.11)."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.content import (
    Attribute,
    Content,
    Draw,
    Fitting,
    Mesh,
    Node,
    Primitive,
    target_called,
)
from meshcone.assets.content.faults import Faults
from meshcone.assets.gltf.accessors import Accessor, Accessors, decode
from meshcone.assets.gltf.document import Document
from meshcone.assets.gltf.element import Element
from meshcone.assets.gltf.extensions import VISIBILITY
from meshcone.assets.gltf.lenient import Lenient
from meshcone.assets.gltf.materials import MaterialReader
from meshcone.assets.gltf.motion import MotionReader
from meshcone.assets.gltf.nodes import is_hidden, local_matrix
from meshcone.assets.gltf.parameters import parameters
from meshcone.assets.gltf.pose import Pose
from meshcone.assets.gltf.scene import PlacedPrimitive, Scene

_Read = Callable[[NDArray[np.int64]], NDArray[np.float64]]

_MODES = ("points", "lines", "line loop", "line strip", "triangles", "strip", "fan")
_TRIANGLES = 4
_CORNER_ATTRIBUTES = ("NORMAL", "TANGENT", "TEXCOORD_", "COLOR_", "JOINTS_", "WEIGHTS_")
_LIGHTS = "KHR_lights_punctual"
_VARIANTS = "KHR_materials_variants"
_SAID_OF_NODES = (_LIGHTS, VISIBILITY)  # by members of their own
_WITH_EXTRAS = (
    "scenes",
    "nodes",
    "meshes",
    "materials",
    "textures",
    "images",
    "animations",
    "skins",
    "cameras",
)


def read_content(document: Document, accessors: Accessors, scene: Scene) -> Content:
    """Describe a document whose scene has been read.

    Args:
        document: as the file has it.
        accessors: of the document without compressed geometry.
        scene: what it draws.
    """
    return _Reader(document, accessors, scene).read()


class _Reader:
    def __init__(self, document: Document, accessors: Accessors, scene: Scene) -> None:
        self._faults = Faults()
        self._root = Lenient(document.root, self._faults)
        self._accessors = accessors
        self._scene = scene

    def read(self) -> Content:
        root = self._root
        materials = MaterialReader(root)
        motion = MotionReader(root, self._accessors)
        nodes = tuple(self._nodes())
        meshes = tuple(map(self._mesh, self._mesh_objects))
        return Content(
            nodes=nodes,
            meshes=meshes,
            draws=tuple(self._draws(meshes)),
            other_draws=_other_draws(nodes, meshes),
            materials=materials.materials(),
            images=materials.images(self._accessors),
            textures=materials.textures,
            skins=motion.skins(),
            animations=motion.animations(),
            cameras=tuple(map(_fitting, root.children("cameras"))),
            lights=tuple(map(_fitting, self._lights)),
            scenes=tuple(scene.name for scene in root.children("scenes")),
            extensions_used=tuple(root.texts("extensionsUsed")),
            extensions_required=tuple(root.texts("extensionsRequired")),
            buffer_bytes=sum(each.integer("byteLength") or 0 for each in root.children("buffers")),
            extras=dict(self._extras()),
            variants=self._variants,
            faults=self._faults.found(),
            stored=self._scene.stored,
        )

    @cached_property
    def _node_objects(self) -> list[Lenient]:
        return self._root.children("nodes")

    @cached_property
    def _mesh_objects(self) -> list[Lenient]:
        return self._root.children("meshes")

    @cached_property
    def _lights(self) -> list[Lenient]:
        extension = self._root.extension(_LIGHTS)
        return extension.children("lights") if extension else []

    @cached_property
    def _variants(self) -> tuple[str, ...]:
        extension = self._root.extension(_VARIANTS)
        return tuple(each.name for each in extension.children("variants")) if extension else ()

    @cached_property
    def _counts(self) -> dict[str, int]:
        arrays = ("meshes", "skins", "cameras", "materials")
        return {array: len(self._root.children(array)) for array in arrays}

    def _nodes(self) -> Iterator[Node]:
        parents, depths = self._tree()
        for index, node in enumerate(self._node_objects):
            light = node.extension(_LIGHTS)
            matrix = node.attempt(local_matrix)
            yield Node(
                name=node.name,
                parent=parents.get(index),
                depth=depths.get(index, 0),
                matrix=np.eye(4) if matrix is None else matrix,
                mesh=node.reference("mesh", self._counts["meshes"], "mesh"),
                skin=node.reference("skin", self._counts["skins"], "skin"),
                camera=node.reference("camera", self._counts["cameras"], "camera"),
                light=light.reference("light", len(self._lights), "light") if light else None,
                hidden=node.attempt(is_hidden) or False,
                extensions=tuple(each for each in node.extensions() if each not in _SAID_OF_NODES),
            )

    def _tree(self) -> tuple[dict[int, int], dict[int, int]]:
        """Parent and depth of each node that a scene reaches; each node is reached once."""
        count = len(self._node_objects)
        families = [node.references("children", count, "node") for node in self._node_objects]
        parents: dict[int, int] = {}
        depths: dict[int, int] = {}
        for scene in self._root.children("scenes"):
            waiting = [(root, -1) for root in scene.references("nodes", count, "node")]
            while waiting:
                node, parent = waiting.pop()
                if node in depths:
                    continue
                depths[node] = depths.get(parent, 0) + 1
                if parent >= 0:
                    parents[node] = parent
                waiting += [(child, node) for child in families[node]]
        return parents, depths

    def _mesh(self, mesh: Lenient) -> Mesh:
        names = mesh.extras.get("targetNames") if isinstance(mesh.extras, dict) else None
        return Mesh(
            name=mesh.name,
            primitives=tuple(map(self._primitive, mesh.children("primitives"))),
            target_names=tuple(map(str, names)) if isinstance(names, list) else (),
        )

    def _primitive(self, primitive: Lenient) -> Primitive:
        mode = primitive.integer("mode")
        attributes = primitive.child("attributes")
        elements = self._accessors.elements
        position = (
            attributes.reference("POSITION", len(elements), "accessor") if attributes else None
        )
        count = None
        if position is not None:
            count = Lenient(elements[position], self._faults).integer("count")
        material = primitive.reference("material", self._counts["materials"], "material")
        return Primitive(
            material=material,
            mode=_MODES[_TRIANGLES if mode is None else min(mode, len(_MODES) - 1)],
            vertices=count or 0,
            attributes=tuple(sorted(attributes.members())) if attributes else (),
            targets=len(primitive.children("targets")),
            gpu_bytes=self._stored_bytes(primitive, attributes),
            variants=tuple(self._mapped(primitive)),
            undefined=material is None and "material" in primitive.members(),
        )

    def _mapped(self, primitive: Lenient) -> Iterator[tuple[str, int]]:
        extension = primitive.extension(_VARIANTS)
        for mapping in extension.children("mappings") if extension else ():
            material = mapping.reference("material", self._counts["materials"], "material")
            for number in mapping.references("variants", len(self._variants), "variant"):
                if material is not None:
                    yield self._variants[number], material

    def _stored_bytes(self, primitive: Lenient, attributes: Lenient | None) -> dict[int, int]:
        named = [(attributes, name) for name in attributes.members()] if attributes else []
        count = len(self._accessors.elements)
        indices = [
            holder.reference(name, count, "accessor")
            for holder, name in [*named, (primitive, "indices")]
        ]
        return {index: self._size(index) for index in indices if index is not None}

    def _size(self, accessor: int) -> int:
        described = Lenient(self._accessors.elements[accessor], self._faults).attempt(
            lambda _: self._accessors.describe(accessor)
        )
        return described.size if described else 0

    def _draws(self, meshes: tuple[Mesh, ...]) -> Iterator[Draw]:
        start = 0
        for placed in self._scene.primitives:
            placement = self._scene.blocks[placed.block].placement
            number = int(placed.primitive.element.pointer.rpartition("/")[2])
            end = start + len(placed.triangles)
            corners = placed.triangles - self._scene.blocks[placed.block].start
            yield Draw(
                node=placement.node,
                mesh=placement.mesh,
                primitive=number,
                material=meshes[placement.mesh].primitives[number].material,
                rows=np.arange(start, end),
                attributes=dict(self._attributes(placed, corners)),
                matrix=placement.matrix,
                others=dict(self._others(placed, corners)),
                mirrored=placement.mirrored,
            )
            start = end

    def _attributes(
        self, placed: PlacedPrimitive, corners: NDArray[np.int64]
    ) -> Iterator[tuple[str, Attribute]]:
        attributes = Lenient(placed.primitive.element, self._faults).child("attributes")
        pose = self._scene.blocks[placed.block].pose
        for name, found in self._of_corners(placed, corners, attributes):
            if not name.startswith(_CORNER_ATTRIBUTES):
                continue
            if name == "NORMAL" and len(pose.matrices) > 1:
                yield name, replace(found, read=partial(_posed, found.read, pose))
            else:
                yield name, found

    def _others(
        self, placed: PlacedPrimitive, corners: NDArray[np.int64]
    ) -> Iterator[tuple[str, Attribute]]:
        primitive = Lenient(placed.primitive.element, self._faults)
        known = ("POSITION", *_CORNER_ATTRIBUTES)
        for name, found in self._of_corners(placed, corners, primitive.child("attributes")):
            if not name.startswith(known):
                yield name, found
        for number, target in enumerate(primitive.children("targets")):
            for name, found in self._of_corners(placed, corners, target):
                called = target_called(number, name)
                yield called, replace(found, name=called)

    def _of_corners(
        self, placed: PlacedPrimitive, corners: NDArray[np.int64], holder: Lenient | None
    ) -> Iterator[tuple[str, Attribute]]:
        vertices = placed.primitive.position.count
        for name in holder.members() if holder else ():
            if holder is None:
                continue
            stored = holder.attempt(partial(self._stored, name=name, vertices=vertices))
            if stored is not None:
                yield name, Attribute(name, corners, partial(self._values, stored), stored.step)

    def _stored(self, attributes: Element, *, name: str, vertices: int) -> Accessor:
        index = attributes.reference(name, len(self._accessors.elements), "accessor")
        assert index is not None  # noqa: S101 - the name was just found
        accessor = self._accessors.describe(index)
        if accessor.count != vertices:
            raise accessor.element.error(
                "count", f"{accessor.count} of {name} for {vertices} positions"
            )
        return accessor

    def _values(self, accessor: Accessor, rows: NDArray[np.int64]) -> NDArray[np.float64]:
        return decode(self._accessors.read_rows(accessor, rows), accessor.normalized)

    def _extras(self) -> Iterator[tuple[str, str]]:
        asset = self._root.child("asset")
        for each in (self._root, asset) if asset else (self._root,):
            if each.extras is not None:
                yield f"{each.pointer}/extras", _digest(each.extras)
        if asset and (copyright_ := asset.text("copyright")):
            yield "/asset/copyright", _digest(copyright_)
        for array in _WITH_EXTRAS:
            for each in self._root.children(array):
                if each.extras is not None:
                    yield each.pointer, _digest(each.extras)


def _posed(read: _Read, pose: Pose, rows: NDArray[np.int64]) -> NDArray[np.float64]:
    """(r, 3) normals as they are shown: joints have turned them."""
    return pose.turn_normals(read(rows), rows)


def _fitting(element: Lenient) -> Fitting:
    return Fitting(element.name, parameters(element.element.value))


def _other_draws(nodes: tuple[Node, ...], meshes: tuple[Mesh, ...]) -> int:
    """Draws of points and lines at the nodes that a scene reaches."""
    others = [
        sum(_MODES.index(primitive.mode) < _TRIANGLES for primitive in mesh.primitives)
        for mesh in meshes
    ]
    return sum(others[node.mesh] for node in nodes if node.depth and node.mesh is not None)


def _digest(value: Any) -> str:
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()
