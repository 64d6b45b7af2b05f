"""Compresses again what came compressed with meshopt, after vertices have moved.

A view whose bytes are what its stream held keeps that stream, byte for byte, and so everything does
that did not move: indices, texture coordinates, weights, animations. Any other view becomes a new
stream without a filter: filters round, and the codec itself does not. Views that writing has
added, such as positions that no longer fit their integers, are compressed like them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import meshopt
import numpy as np

from meshcone.assets.gltf.accessors import Accessors
from meshcone.assets.gltf.buffers import Buffers
from meshcone.assets.gltf.document import Document
from meshcone.assets.gltf.draft import Draft
from meshcone.assets.gltf.json_text import spelled
from meshcone.assets.gltf.meshopt.expand import LARGEST_STRIDE, Expanded
from meshcone.assets.gltf.splice import JsonChanges, change_json
from meshcone.assets.limits import Limits

_VERSION = 0  # of the bitstream: the one that both extensions can hold
_PLACE = ("buffer", "byteOffset", "byteLength")
_ALIGNMENT = 8


@dataclass(frozen=True)
class _Stream:
    """What a view is compressed to.

    Attributes:
        data: the compressed bytes.
        size: how many bytes they hold.
        members: of the extension, besides where the data are.
    """

    data: bytes
    size: int
    members: Mapping[str, Any]


def compress_again(
    document: Document, buffers: Buffers, came: Expanded, limits: Limits
) -> tuple[Document, Buffers]:
    """Put the streams back that a document came with, and new ones for what has changed.

    Args:
        document: its plain form with any changes; buffer views have the indices they had.
        buffers: of that.
        came: what the file was before it was expanded.
        limits: those it was read under.
    """
    if not came.squeezed:
        return document, buffers
    streams = dict(_streams(Accessors(document, buffers, limits), came))
    draft = Draft(document, buffers, limits)
    for index, stream in streams.items():
        draft.replace(index, stream.data)
    packed, packed_buffers = draft.finish()
    compressed = packed.changed(change_json(packed.text, _changes(packed, came, streams)))
    return compressed, packed_buffers.belonging_to(compressed, None)


def _streams(accessors: Accessors, came: Expanded) -> Iterator[tuple[int, _Stream]]:
    for view in came.squeezed:
        data = accessors.view_bytes(view.index)
        if data == came.decoded[view.index]:
            members = {k: v for k, v in view.extension.value.items() if k not in _PLACE}
            yield view.index, _Stream(view.data(came.packed), len(data), members)
        elif view.mode == "ATTRIBUTES":  # others are for indices, whose order would change
            yield view.index, _encoded(data, view.stride)
    sizes = {
        added: described.size // described.count
        for index, element in enumerate(accessors.elements)
        if (added := element.integer("bufferView")) is not None
        and added >= len(came.original.root.children("bufferViews"))
        and (described := accessors.describe(index)).count
    }
    for index, size in sizes.items():
        stride = accessors.views[index].integer("byteStride") or size
        if stride % 4 == 0 and stride <= LARGEST_STRIDE:
            yield index, _encoded(accessors.view_bytes(index), stride)


def _encoded(data: bytes, stride: int) -> _Stream:
    rows = np.frombuffer(data, np.uint8).reshape(-1, stride)
    members = {"byteStride": stride, "count": len(rows), "mode": "ATTRIBUTES"}
    return _Stream(meshopt.encode_gltf_buffer(rows, "ATTRIBUTES", _VERSION), len(data), members)


def _changes(packed: Document, came: Expanded, streams: Mapping[int, _Stream]) -> JsonChanges:
    """What turns views that hold streams into views that are compressed."""
    original = came.original.root.children("bufferViews")
    first = came.squeezed[0]
    name, fallback = first.name, first.element.value["buffer"]
    buffers = _buffers(packed, came)
    changes = JsonChanges()
    plain = len(came.document.root.children("buffers"))
    shift = len(came.original.root.children("buffers")) - plain  # of those that writing has added
    for index, element in enumerate(packed.root.children("bufferViews")):
        stream = streams.get(index)
        buffer = element.integer("buffer")
        added = {} if buffer is None or buffer < plain else {"buffer": buffer + shift}
        if stream is None:
            for key, value in added.items():
                changes.replaced["bufferViews", index, key] = spelled(value)
            continue
        placed = {key: element.value[key] for key in _PLACE} | added
        if index < len(original):
            view = dict(original[index].value)
        else:
            start = -(-buffers[fallback]["byteLength"] // _ALIGNMENT) * _ALIGNMENT
            buffers[fallback]["byteLength"] = start + stream.size
            view = element.value | {
                "buffer": fallback,
                "byteOffset": start,
                "byteLength": stream.size,
            }
        extension = {**placed, **stream.members}
        view["extensions"] = view.get("extensions", {}) | {name: extension}
        changes.replaced["bufferViews", index] = spelled(view)
    changes.replaced["buffers",] = spelled(buffers)
    for key in ("extensionsUsed", "extensionsRequired"):
        _restore_name(packed, came.original, key, name, changes)
    return changes


def _buffers(packed: Document, came: Expanded) -> list[dict[str, Any]]:
    """Those that have bytes as they are now, and those to decompress into as they came.

    What writing has added stands behind both.
    """
    now = [element.value for element in packed.root.children("buffers")]
    came_as = [element.value for element in came.original.root.children("buffers")]
    stored = [dict(now[n] if came.packed.is_stored(n) else v) for n, v in enumerate(came_as)]
    return stored + [dict(each) for each in now[len(came.document.root.children("buffers")) :]]


def _restore_name(
    packed: Document, original: Document, key: str, name: str, changes: JsonChanges
) -> None:
    if name not in original.root.texts(key):
        return
    names = spelled([*packed.root.texts(key), name])
    if key in packed.root.value:
        changes.replaced[(key,)] = names
    else:
        changes.added[()].append(f"{spelled(key)}: {names}")
