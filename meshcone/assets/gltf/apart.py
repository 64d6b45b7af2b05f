"""Gives a vertex attribute a buffer view of its own."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.gltf.accessors import Accessor, Accessors
from meshcone.assets.gltf.draft import Draft

_ARRAY_BUFFER = 34962
_STRIDE_ALIGNMENT = 4  # of vertex attributes (section 3.6.2.4)
_PLACE = ("byteOffset", "sparse")


def copy_apart(draft: Draft, accessors: Accessors, accessor: Accessor) -> int:
    """Append a copy of an accessor, with a copy of its elements; returns its index."""
    view = _store(draft, accessors.read(accessor), _buffer(accessor))
    kept = {key: value for key, value in accessor.element.value.items() if key not in _PLACE}
    return draft.append("accessors", kept | {"bufferView": view})


def move_apart(draft: Draft, accessors: Accessors, accessor: Accessor) -> None:
    """Let an accessor read a copy of its elements."""
    place_apart(draft, accessor, accessors.read(accessor), _buffer(accessor), {})


def place_apart(
    draft: Draft,
    accessor: Accessor,
    stored: NDArray[Any],
    buffer: int,
    declared: Mapping[str, Any],
) -> None:
    """Let an accessor read other elements.

    Args:
        draft: takes the changes.
        accessor: the accessor.
        stored: (count, columns) components.
        buffer: the buffer to append them to.
        declared: members of the accessor that change with them.
    """
    path = ("accessors", accessor.index)
    draft.put((*path, "bufferView"), _store(draft, stored, buffer))
    for key, value in declared.items():
        draft.put((*path, key), value)
    for key in _PLACE:
        if key in accessor.element.value:
            draft.remove((*path, key))


def _buffer(accessor: Accessor) -> int:
    return accessor.regions[0].buffer if accessor.regions else 0


def _store(draft: Draft, stored: NDArray[Any], buffer: int) -> int:
    size = stored.dtype.itemsize
    members = {"target": _ARRAY_BUFFER}
    padding = -size * stored.shape[1] % _STRIDE_ALIGNMENT
    if padding:
        stored = np.pad(stored, ((0, 0), (0, padding // size)))
        members["byteStride"] = size * stored.shape[1]
    return draft.store(buffer, np.ascontiguousarray(stored).tobytes(), members)
