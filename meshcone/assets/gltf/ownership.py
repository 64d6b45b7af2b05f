"""Whether the vertices of a scene can be moved without moving anything else.

glTF shares freely: a mesh between nodes, an accessor between meshes, bytes between
accessors. A shared vertex cannot go to two places, so such a file is refused by name
before any solving is done.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Hashable, Set

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.gltf.accessors import Accessors, Region
from meshcone.assets.gltf.document import Document
from meshcone.assets.gltf.extensions import MANIFOLD
from meshcone.assets.gltf.moving import Moving
from meshcone.assets.gltf.overlaps import Marks, bystanders
from meshcone.assets.gltf.scene import Block, mesh_name
from meshcone.assets.gltf.uses import accessor_uses, manifold_of
from meshcone.errors import InputError

# Attribute, and what the positions that it belongs to have to themselves.
Owner = tuple[str, Hashable]


def check_ownership(
    document: Document, accessors: Accessors, moving: Moving, ignored: Set[str]
) -> None:
    """Check that every vertex that may move has bytes of its own.

    Args:
        document: the document.
        accessors: its accessors.
        moving: what of its scene may move.
        ignored: pointers to what nothing can read.

    Raises:
        InputError: a mesh or accessor is used twice, a node or joints flatten what they place, or
            bytes are shared.
    """
    _check_instances(document, moving)
    for block in moving.blocks:
        _check_transform(document, block, moving.rows[block.rows])
    owners = _owners(moving)
    _check_other_uses(document, owners, {block.placement.mesh for block in moving.blocks})
    _check_manifolds(document, moving.blocks)
    _check_shared_bytes(document, accessors, owners, ignored)


def _check_instances(document: Document, moving: Moving) -> None:
    meshes = document.root.children("meshes")
    nodes_of_mesh: dict[int, list[int]] = defaultdict(list)
    for index, node in enumerate(document.root.children("nodes")):
        mesh = node.reference("mesh", len(meshes), "mesh")
        if mesh is not None:
            nodes_of_mesh[mesh].append(index)
    for block in moving.blocks:
        placement = block.placement
        if placement.mesh in moving.together:
            continue
        users = nodes_of_mesh[placement.mesh]
        if len(users) > 1 or placement.instance is not None:
            used = f"used by {_listed('node', users)}" if len(users) > 1 else "placed many times"
            raise InputError(
                f"{mesh_name(meshes, placement.mesh)} is {used}; "
                "one mesh cannot take several shapes: give each node a mesh of its own, "
                "or set instances=split",
                place=f"/meshes/{placement.mesh}",
            )
    blocks_of_accessor: dict[int, list[Block]] = defaultdict(list)
    for block in moving.blocks:
        blocks_of_accessor[block.accessor.index].append(block)
    for accessor, blocks in blocks_of_accessor.items():
        together = {block.placement.mesh for block in blocks} <= moving.together
        if len(blocks) > 1 and not (together and len(set(map(moving.home, blocks))) == 1):
            users = [block.placement.mesh for block in blocks]
            raise InputError(
                f"accessor {accessor} holds the positions of {_listed('mesh', users)}; "
                "give each mesh positions of its own, or set instances=split",
                place=f"/accessors/{accessor}",
            )


def _check_transform(document: Document, block: Block, moving: NDArray[np.bool_]) -> None:
    node = document.root.children("nodes")[block.placement.node]
    lost = moving & block.pose.irreversible()
    if not lost.any():
        return
    if len(block.pose.matrices) == 1:
        raise InputError(
            f"node {block.placement.node} flattens its mesh: its transform cannot be undone",
            place=node.pointer,
        )
    mesh = mesh_name(document.root.children("meshes"), block.placement.mesh)
    raise InputError(
        f"vertex {np.flatnonzero(lost)[0]} of {mesh} cannot be moved: its joints flatten what is "
        "around it, and that cannot be undone; set pose=bind, or leave it out with 'select'",
        place=node.pointer,
    )


def _owners(moving: Moving) -> dict[int, Owner]:
    """What each accessor that will be written is for: attribute, and positions.

    Raises:
        InputError: one is for two things.
    """
    owners: dict[int, Owner] = {}
    for placed, role, accessor in moving.written():
        block = moving.scene.blocks[placed.block]
        owner = (role, moving.identity(block))
        if owners.setdefault(accessor.index, owner) != owner:
            raise InputError(
                f"its values serve as {role} of several sets of positions; give each its own, "
                "or set instances=split",
                place=accessor.element.pointer,
            )
    return owners


def _check_other_uses(document: Document, owners: dict[int, Owner], moving: set[int]) -> None:
    """Whatever else reads an accessor must not read what is about to change."""
    count = len(document.root.children("accessors"))
    for use in accessor_uses(document.root, count):
        if use.accessor not in owners:
            continue
        if use.mesh not in moving or owners[use.accessor][0] != use.name:
            raise use.holder.error(
                use.name,
                f"reads accessor {use.accessor}, whose values would change; set instances=split",
            )


def _check_manifolds(document: Document, blocks: list[Block]) -> None:
    """What is said to be the whole of a mesh must have the positions of the mesh, to move along."""
    meshes = document.root.children("meshes")
    count = len(document.root.children("accessors"))
    positions: dict[int, set[int]] = defaultdict(set)
    for block in blocks:
        positions[block.placement.mesh].add(block.accessor.index)
    for mesh, moved in positions.items():
        whole = manifold_of(meshes[mesh])
        attributes = None if whole is None else whole.child("attributes")
        if attributes is None:
            continue
        found = attributes.reference("POSITION", count, "accessor")
        if found not in moved:
            raise attributes.error(
                "POSITION",
                f"'{MANIFOLD}' must read the positions of {mesh_name(meshes, mesh)}, found others, "
                "which would not move along: name the accessor that the primitives of the mesh "
                "name, or remove the extension",
            )


def _check_shared_bytes(
    document: Document, accessors: Accessors, owners: dict[int, Owner], ignored: Set[str]
) -> None:
    described = {index: accessors.describe(index) for index in owners}
    buffers = {region.buffer for each in described.values() for region in each.values}
    taken = Marks(accessors.buffers, buffers)
    claimed: dict[Region, Owner] = {}
    for index, owner in owners.items():
        # Exporters like to declare one run of vertices once per primitive: that is no conflict.
        regions = [r for r in described[index].values if claimed.get(r) != owner]
        if taken.touch(regions):
            raise _shared(described[index].element.pointer)
        claimed.update(dict.fromkeys(regions, owner))
        taken.add(regions)
    for pointer, regions in bystanders(document, accessors, owners.keys(), ignored):
        if taken.touch(regions):
            raise _shared(pointer)


def _shared(pointer: str) -> InputError:
    return InputError(
        "shares bytes with vertex data that is written, so neither can change alone; "
        "set instances=split",
        place=pointer,
    )


def _listed(what: str, numbers: list[int]) -> str:
    distinct = sorted(set(numbers))
    shown = ", ".join(map(str, distinct[:5])) + (", …" if len(distinct) > 5 else "")
    plural = what if len(distinct) == 1 else {"mesh": "meshes"}.get(what, what + "s")
    return f"{plural} {shown}"
