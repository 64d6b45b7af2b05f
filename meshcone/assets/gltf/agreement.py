"""Whether all places of a shared mesh ask for the same new shape."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.gltf.accessors import Accessor, Accessors, decode
from meshcone.assets.gltf.document import Document
from meshcone.assets.gltf.moving import Moving
from meshcone.assets.gltf.scene import Block

_STEPS = 4  # of what the file can tell apart


def agreeing_meshes(
    document: Document,
    accessors: Accessors,
    moving: Moving,
    positions: NDArray[np.float64],
    moved: NDArray[np.bool_],
) -> frozenset[int]:
    """The meshes that can be moved once for all nodes that use them.

    Every node that uses one has to move it, and what each asks for, taken back through its
    transform, must be the same to a few of the steps in which the file stores positions.

    Args:
        document: the file.
        accessors: its accessors.
        moving: what of its scene may move.
        positions: (r, 3) world positions to be written.
        moved: (r,) which of them differ from the file's.
    """
    users: dict[int, set[int]] = defaultdict(set)
    count = len(document.root.children("meshes"))
    for index, node in enumerate(document.root.children("nodes")):
        mesh = node.reference("mesh", count, "mesh")
        if mesh is not None:
            users[mesh].add(index)
    places: dict[int, list[Block]] = defaultdict(list)
    for block in moving.blocks:
        places[block.accessor.index].append(block)
    shared = {b.placement.mesh for blocks in places.values() if len(blocks) > 1 for b in blocks}
    for blocks in places.values():
        meshes = {block.placement.mesh for block in blocks}
        complete = {block.placement.node for block in blocks} >= users[min(meshes)]
        if len(meshes) > 1 or not complete or not _agree(blocks, accessors, positions, moved):
            shared -= meshes
    return frozenset(shared)


def _agree(
    blocks: list[Block],
    accessors: Accessors,
    positions: NDArray[np.float64],
    moved: NDArray[np.bool_],
) -> bool:
    accessor = blocks[0].accessor
    stored = decode(accessors.read(accessor), accessor.normalized)
    rows = np.flatnonzero(np.any([moved[block.rows] for block in blocks], axis=0))
    asked = []
    for block in blocks:
        if block.pose.irreversible().any():
            return False
        restored = block.pose.restore(positions[block.rows][rows], rows)
        asked.append(np.where(moved[block.rows][rows, None], restored, stored[rows]))
    spread = np.ptp(np.stack(asked), axis=0)
    return bool((spread <= _STEPS * _step(accessor, stored[rows])).all())


def _step(accessor: Accessor, values: NDArray[np.float64]) -> float:
    """The difference between neighbouring numbers that an accessor can store."""
    if accessor.component.kind != "f":
        return 1 / np.iinfo(accessor.component).max if accessor.normalized else 1.0
    return float(np.spacing(np.float32(np.abs(values).max(initial=0.0))))
