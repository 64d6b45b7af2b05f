"""Makes room for positions that cannot be stored where the file has them.

*Integers out of range.* An exporter spends the whole range of its integers on a mesh's bounding
box, so that a vertex that moves outwards by a step already has no number. Refusing it would
refuse most quantised files, and stretching the grid by the node's transform would move every
other vertex by up to half a step and reach into the node's children. Floats hold every value
the integers held.

*Zeros that are not stored.* A sparse accessor without a buffer view is zero wherever it does
not say otherwise (section 3.6.2.3). Where such a vertex moves, all of them are stored.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.gltf.accessors import Accessor, bounds, decode, encode
from meshcone.assets.gltf.apart import place_apart
from meshcone.assets.gltf.buffers import Buffers
from meshcone.assets.gltf.document import Document
from meshcone.assets.gltf.draft import Draft
from meshcone.assets.gltf.model import Model

_FLOAT = 5126


def make_room(
    model: Model, positions: NDArray[np.float64], moved: NDArray[np.bool_]
) -> tuple[Document, Buffers] | None:
    """Let each POSITION accessor that cannot hold its new values read other elements.

    Args:
        model: the file.
        positions: (r, 3) world positions to be written.
        moved: (r,) which of them differ from the file's.

    Returns:
        The document and its buffers, or None if all values have their place.
    """
    draft = Draft(model.document, model.accessors.buffers, model.limits)
    placed: set[int] = set()
    for block in model.scene.blocks:
        accessor = block.accessor
        rows = np.flatnonzero(moved[block.rows])
        if accessor.index in placed or len(rows) == 0:
            continue
        local = block.pose.restore(positions[block.rows][rows], rows)
        fits = encode(local, accessor.component, accessor.normalized) is not None
        stored = accessor.dense or np.isin(rows, model.accessors.sparse_rows(accessor)).all()
        if (fits or accessor.component.kind == "f") and stored:
            continue
        placed.add(accessor.index)
        values = model.accessors.read(accessor)
        declared = {}
        if not fits:
            values = decode(values, accessor.normalized).astype("<f4")
            declared = _as_floats(accessor, values)
        buffer = accessor.regions[0].buffer if accessor.regions else 0
        place_apart(draft, accessor, values, buffer, declared)
    return draft.finish() if placed else None


def _as_floats(accessor: Accessor, values: NDArray[Any]) -> dict[str, Any]:
    declared: dict[str, Any] = {"componentType": _FLOAT}
    if accessor.normalized:
        declared["normalized"] = False
    found = bounds(values)
    return declared | {key: found[key] for key in found if key in accessor.element.value}
