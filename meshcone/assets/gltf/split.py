"""Gives vertex data that several nodes or meshes share to each that moves, as a copy."""

from __future__ import annotations

import copy
from collections import defaultdict
from collections.abc import Hashable, Iterator, Set
from dataclasses import dataclass
from typing import Any

from meshcone.assets.gltf.accessors import Accessor, Accessors
from meshcone.assets.gltf.apart import copy_apart, move_apart
from meshcone.assets.gltf.buffers import Buffers
from meshcone.assets.gltf.document import Document
from meshcone.assets.gltf.draft import Draft
from meshcone.assets.gltf.element import Element
from meshcone.assets.gltf.moving import Moving
from meshcone.assets.gltf.overlaps import Marks, bystanders
from meshcone.assets.gltf.references import animate_copy, meshes_named
from meshcone.assets.gltf.scene import mesh_name
from meshcone.assets.gltf.uses import accessor_uses, drawn_or_described
from meshcone.assets.limits import Limits
from meshcone.errors import InputError


def split_shared(
    document: Document,
    accessors: Accessors,
    moving: Moving,
    limits: Limits,
    ignored: Set[str],
) -> tuple[Document, Buffers] | None:
    """Copy what cannot move in one place without moving in another.

    A mesh that several nodes use stays with those that do not move, or else with the first;
    every other node gets a copy of it. Then each attribute that is written gets bytes of its
    own, unless nothing else reads those it has, and an accessor of its own, unless nothing else
    uses the one it has. What nobody needs twice stays shared: indices, texture coordinates,
    weights, morph targets. Animations that move a mesh move its copies too.

    Args:
        document: the document.
        accessors: its accessors.
        moving: what of its scene may move.
        limits: caps on sizes.
        ignored: pointers to what nothing can read.

    Returns:
        The document and its buffers, or None if nothing is shared.

    Raises:
        InputError: too many accessors read the same bytes, or an extension says something of a
            mesh by its number, which would not be said of its copies.
        LimitError: the copies are more than ``limits`` accept.
    """
    draft = Draft(document, accessors.buffers, limits)
    meshes = _copy_meshes(draft, document, moving)
    claims = _Claims(document, accessors, meshes, moving, ignored)
    apart: dict[tuple[Hashable, int], int] = {}
    for use in claims.uses():
        if claims.grants_bytes(use):
            continue
        # Two accessors over the same bytes stay two, so that vertices keep their numbers.
        key = (use.key, use.accessor.index)
        if key not in apart and claims.grants_accessor(use):
            move_apart(draft, accessors, use.accessor)
            apart[key] = use.accessor.index
        elif key not in apart:
            apart[key] = copy_apart(draft, accessors, use.accessor)
        if apart[key] != use.accessor.index:
            use.point_to(draft, apart[key])
    changed = bool(apart) or any(mesh.is_copy for mesh in meshes.values())
    return draft.finish() if changed else None


_ELSEWHERE = object()


@dataclass
class _NodeMesh:
    """The mesh of a node that moves.

    Attributes:
        index: its index in the new document.
        value: its JSON; of a copy, the one that is appended.
    """

    node: int
    index: int
    value: dict[str, Any]
    pointer: str
    is_copy: bool


def _copy_meshes(draft: Draft, document: Document, moving: Moving) -> dict[int, _NodeMesh]:
    """The mesh each moving node shall use, by node."""
    elements = document.root.children("meshes")
    mesh_of_node = {block.placement.node: block.placement.mesh for block in moving.blocks}
    for shared in moving.together:  # as if one node used it
        for further in [node for node, used in mesh_of_node.items() if used == shared][1:]:
            del mesh_of_node[further]
    users: dict[int, list[int]] = defaultdict(list)
    for index, node in enumerate(document.root.children("nodes")):
        mesh = node.reference("mesh", len(elements), "mesh")
        if mesh is not None:
            users[mesh].append(index)
    meshes: dict[int, _NodeMesh] = {}
    kept = {
        mesh
        for mesh, nodes in users.items()
        if mesh not in moving.together and any(n not in mesh_of_node for n in nodes)
    }
    for moving_node, mesh in mesh_of_node.items():
        element = elements[mesh]
        if mesh not in kept:
            kept.add(mesh)
            meshes[moving_node] = _NodeMesh(
                moving_node, mesh, element.value, element.pointer, is_copy=False
            )
            continue
        value = copy.deepcopy(element.value)
        appended = draft.append("meshes", value)
        meshes[moving_node] = _NodeMesh(moving_node, appended, value, element.pointer, is_copy=True)
        draft.put(("nodes", moving_node, "mesh"), appended)
    _name_copies(
        draft, document, [(mesh_of_node[m.node], m.index) for m in meshes.values() if m.is_copy]
    )
    return meshes


def _name_copies(draft: Draft, document: Document, copies: list[tuple[int, int]]) -> None:
    """Say of copies what is said of their meshes by number.

    Args:
        draft: takes the changes.
        document: the document.
        copies: a mesh and a copy of it, for each copy.

    Raises:
        InputError: an extension names such a mesh.
    """
    named = meshes_named(document.root) if copies else []
    for mesh, added in copies:
        told = next((naming for naming in named if naming.may_be(mesh)), None)
        if told is not None:
            called = mesh_name(document.root.children("meshes"), mesh)
            raise InputError(
                f"'{told.extension[:80]}' names {called} by its number, and what it says would not "
                "hold for the copies that some of its nodes need: give each node a mesh of its "
                "own, leave them out with 'select', or remove it",
                place=told.place,
            )
        animate_copy(draft, document.root, mesh, added)


@dataclass(frozen=True)
class _Use:
    """An attribute of a mesh that is written.

    Attributes:
        primitive: where in the mesh the primitive is.
        key: what may share bytes with it: the same attribute of the same positions at a node.
    """

    mesh: _NodeMesh
    primitive: tuple[str | int, ...]
    role: str
    accessor: Accessor
    key: Hashable

    def point_to(self, draft: Draft, accessor: int) -> None:
        """Use another accessor."""
        path = (*self.primitive, "attributes")
        if self.mesh.is_copy:
            attributes: Any = self.mesh.value
            for key in path:
                attributes = attributes[key]
            attributes[self.role] = accessor
        else:
            draft.put(("meshes", self.mesh.index, *path, self.role), accessor)


class _Claims:
    """Who reads the bytes of each accessor, and who uses it."""

    def __init__(
        self,
        document: Document,
        accessors: Accessors,
        meshes: dict[int, _NodeMesh],
        moving: Moving,
        ignored: Set[str],
    ) -> None:
        self._accessors = accessors
        self._root = document.root
        self._meshes = meshes
        self._written: dict[tuple[int, str, int], Hashable] = {}
        self._identities: dict[tuple[int, str], Hashable] = {}
        for placed, role, accessor in moving.written():
            block = moving.scene.blocks[placed.block]
            node, identity = block.placement.node, moving.identity(block)
            self._written.setdefault((node, role, accessor.index), identity)
            self._identities[node, placed.primitive.element.pointer] = identity
        elsewhere = set(self._used_elsewhere())
        self._users: dict[int, Hashable] = dict.fromkeys(elsewhere, _ELSEWHERE)
        self._owners: dict[Hashable, Hashable] = {}
        written = {index: accessors.describe(index) for _, _, index in self._written}
        buffers = {region.buffer for each in written.values() for region in each.values}
        self._read = Marks(accessors.buffers, buffers)
        for _, regions in bystanders(document, accessors, written.keys() - elsewhere, ignored):
            self._read.add(regions)

    def uses(self) -> Iterator[_Use]:
        """Every attribute that is written, node by node."""
        for node, mesh in self._meshes.items():
            for path, pointer, attributes in self._attributes(mesh):
                if "POSITION" not in attributes:  # draws nothing, whatever else it has
                    continue
                for role in ("POSITION", "NORMAL", "TANGENT"):
                    written = self._written.get((node, role, attributes.get(role, -1)))
                    if written is not None:
                        accessor = self._accessors.describe(attributes[role])
                        # What the scene does not have moves along with it: lines over the same
                        # positions, and what an extension says is the whole of the mesh.
                        identity = self._identities.get((node, pointer), written)
                        key = (node, role, accessor.content, identity)
                        yield _Use(mesh, path, role, accessor, key)

    def grants_bytes(self, use: _Use) -> bool:
        """Whether an attribute may keep its bytes, because no other has asked for them."""
        owner = self._owners.get(use.accessor.content)
        if owner is None and not self._read.touch(use.accessor.values):
            self._owners[use.accessor.content] = owner = use.key
            self._users.setdefault(use.accessor.index, use.key)
            self._read.add(use.accessor.values)
        return owner == use.key

    def grants_accessor(self, use: _Use) -> bool:
        """Whether an attribute may keep its accessor, though with other bytes."""
        return self._users.setdefault(use.accessor.index, use.key) == use.key

    def _attributes(
        self, mesh: _NodeMesh
    ) -> Iterator[tuple[tuple[str | int, ...], str, dict[str, int]]]:
        count = len(self._accessors.elements)
        for path, primitive in drawn_or_described(Element(mesh.value, mesh.pointer)):
            attributes = primitive.child("attributes")
            if attributes is not None:
                names = attributes.value
                found = {name: attributes.reference(name, count, "accessor") for name in names}
                known = {name: index for name, index in found.items() if index is not None}
                yield path, primitive.pointer, known

    def _used_elsewhere(self) -> Iterator[int]:
        """Accessors used by what does not move, or for another purpose."""
        moved = {mesh.index: mesh.node for mesh in self._meshes.values() if not mesh.is_copy}
        for use in accessor_uses(self._root, len(self._accessors.elements)):
            node = None if use.mesh is None else moved.get(use.mesh)
            if (node, use.name, use.accessor) not in self._written:
                yield use.accessor
