"""Whether the vertices of a scene can be moved without moving anything else.

glTF shares freely: a mesh between nodes, an accessor between meshes, bytes between
accessors. A shared vertex cannot go to two places, so such a file is refused by name
before any solving is done.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Hashable, Iterable

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.gltf.accessors import Accessors, Region
from meshcone.assets.gltf.document import Document
from meshcone.assets.gltf.moving import Moving
from meshcone.assets.gltf.scene import Block, mesh_name
from meshcone.errors import InputError

# Attribute, what it is moved for, and the bytes of the positions it belongs to.
Owner = tuple[str, Hashable, tuple[Region, ...]]

# Accessors may declare the same bytes any number of times; this bounds the time to compare them.
_COMPARED_BYTES_PER_BYTE = 64


def check_ownership(document: Document, accessors: Accessors, moving: Moving) -> None:
    """Check that every vertex that may move has bytes of its own.

    Raises:
        InputError: a mesh or accessor is used twice, a node or joints flatten what they place, or
            bytes are shared.
    """
    _check_instances(document, moving)
    for block in moving.blocks:
        _check_transform(document, block, moving.rows[block.rows])
    owners = _owners(moving)
    _check_other_uses(document, owners, {block.placement.mesh for block in moving.blocks})
    _check_shared_bytes(document, accessors, owners)


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
    """What each accessor that will be written is for: attribute, node, and positions.

    Raises:
        InputError: one is for two things.
    """
    owners: dict[int, Owner] = {}
    for placed, role, accessor in moving.written():
        block = moving.scene.blocks[placed.block]
        owner = (role, moving.home(block), tuple(block.accessor.regions))
        if owners.setdefault(accessor.index, owner) != owner:
            raise InputError(
                f"its values serve as {role} of several sets of positions; give each its own, "
                "or set instances=split",
                place=accessor.element.pointer,
            )
    return owners


def _check_other_uses(document: Document, owners: dict[int, Owner], moving: set[int]) -> None:
    """Other meshes, morph targets and other attributes may read what is about to change."""
    count = len(document.root.children("accessors"))
    for index, mesh in enumerate(document.root.children("meshes")):
        for primitive in mesh.children("primitives"):
            attributes = primitive.child("attributes")
            for uses in [*([attributes] if attributes else []), *primitive.children("targets")]:
                is_target = uses is not attributes
                for name in uses.value:
                    accessor = uses.reference(name, count, "accessor")
                    if accessor in owners and (
                        is_target or owners[accessor][0] != name or index not in moving
                    ):
                        raise uses.error(
                            name, f"reads accessor {accessor}, whose values would change"
                        )


def _check_shared_bytes(document: Document, accessors: Accessors, owners: dict[int, Owner]) -> None:
    described = {index: accessors.describe(index) for index in range(len(accessors.elements))}
    buffers = {region.buffer for index in owners for region in described[index].regions}
    taken = {buffer: np.zeros(accessors.buffers[buffer].length, dtype=bool) for buffer in buffers}
    budget = _COMPARED_BYTES_PER_BYTE * sum(len(bytes_taken) for bytes_taken in taken.values())
    claimed: dict[Region, Owner] = {}

    def is_taken(regions: Iterable[Region]) -> bool:
        nonlocal budget
        found = False
        for region in regions:
            if region.buffer in taken:
                budget -= region.count * region.size
                if budget < 0:
                    raise InputError("too many accessors cover the same bytes", place="/accessors")
                view = region.elements(taken[region.buffer], np.dtype(bool))
                found = found or bool(view.any())
        return found

    for index, owner in owners.items():
        # Exporters like to declare one run of vertices once per primitive: that is no conflict.
        regions = [r for r in described[index].regions if claimed.get(r) != owner]
        if is_taken(regions):
            raise _shared(index)
        for region in regions:
            claimed[region] = owner
            region.elements(taken[region.buffer], np.dtype(bool))[:] = True
    for index, accessor in described.items():
        if index not in owners and is_taken(accessor.regions):
            raise _shared(index)
    for image in document.root.children("images"):
        view = image.reference("bufferView", len(accessors.views), "buffer view")
        if view is not None:
            start, length, buffer = accessors.view_extent(view)
            if is_taken([Region(buffer, start, length, 1, 1)]):
                raise InputError("shares bytes with vertices that move", place=image.pointer)


def _shared(accessor: int) -> InputError:
    return InputError(
        "shares bytes with the vertex data of another accessor, so neither can move alone",
        place=f"/accessors/{accessor}",
    )


def _listed(what: str, numbers: list[int]) -> str:
    distinct = sorted(set(numbers))
    shown = ", ".join(map(str, distinct[:5])) + (", …" if len(distinct) > 5 else "")
    plural = what if len(distinct) == 1 else {"mesh": "meshes"}.get(what, what + "s")
    return f"{plural} {shown}"
