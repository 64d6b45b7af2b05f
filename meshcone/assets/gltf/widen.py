"""Stores quantised positions as floats where refined values leave the range of the integers.

An exporter spends the whole range of its integers on a mesh's bounding box, so that a vertex
that moves outwards by a step already has no number. Refusing it would refuse most quantised
files, and stretching the grid by the node's transform would move every other vertex by up to
half a step and reach into the node's children. Floats hold every value the integers held.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.gltf.accessors import decode, encode
from meshcone.assets.gltf.affine import restore_points
from meshcone.assets.gltf.apart import place_apart
from meshcone.assets.gltf.buffers import Buffers
from meshcone.assets.gltf.document import Document
from meshcone.assets.gltf.draft import Draft
from meshcone.assets.gltf.model import Model

_FLOAT = 5126


def widen_positions(
    model: Model, positions: NDArray[np.float64], moved: NDArray[np.bool_]
) -> tuple[Document, Buffers] | None:
    """Give each POSITION accessor that cannot hold its new values floats.

    Args:
        model: the file.
        positions: (r, 3) world positions to be written.
        moved: (r,) which of them differ from the file's.

    Returns:
        The document and its buffers, or None if all values fit.
    """
    draft = Draft(model.document, model.accessors.buffers)
    widened: set[int] = set()
    for block in model.scene.blocks:
        accessor = block.accessor
        if accessor.component.kind == "f" or accessor.index in widened:
            continue
        local = restore_points(block.placement.matrix, positions[block.rows][moved[block.rows]])
        if encode(local, accessor.component, accessor.normalized) is not None:
            continue
        widened.add(accessor.index)
        values = decode(model.accessors.read(accessor), accessor.normalized).astype("<f4")
        declared: dict[str, Any] = {"componentType": _FLOAT}
        if accessor.normalized:
            declared["normalized"] = False
        for key, bound in (("min", np.min), ("max", np.max)):
            if key in accessor.element.value:
                declared[key] = bound(values, axis=0).tolist()
        buffer = accessor.regions[0].buffer if accessor.regions else 0
        place_apart(draft, accessor, values, buffer, declared)
    return draft.finish() if widened else None
