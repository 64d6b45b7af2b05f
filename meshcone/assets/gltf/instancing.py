"""Meshes that a node places many times (EXT_mesh_gpu_instancing).

Source: the extension's text in the Khronos glTF repository.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from meshcone.assets.gltf.accessors import Accessors, decode
from meshcone.assets.gltf.buffers import Buffers
from meshcone.assets.gltf.document import Document
from meshcone.assets.gltf.draft import Draft
from meshcone.assets.gltf.element import Element
from meshcone.assets.gltf.extensions import INSTANCING, extension_of
from meshcone.assets.limits import Limits

_KINDS = {"TRANSLATION": "VEC3", "ROTATION": "VEC4", "SCALE": "VEC3"}


def instances(node: Element, accessors: Accessors) -> list[dict[str, Any]] | None:
    """The transform of each instance, as a node below the given one would have it.

    Returns:
        Members of a node for each; None if the node does not use the extension.

    Raises:
        InputError: the extension is malformed.
    """
    extension = extension_of(node, INSTANCING)
    attributes = None if extension is None else extension.child("attributes")
    if attributes is None:
        return None
    found: dict[str, list[Any]] = {}
    count = None
    for name, kind in _KINDS.items():
        index = attributes.reference(name, len(accessors.elements), "accessor")
        if index is None:
            continue
        accessor = accessors.describe(index)
        if accessor.kind != kind:
            raise accessor.element.error("type", f"{name} must be {kind}, found {accessor.kind}")
        if accessor.count != (accessor.count if count is None else count):
            raise attributes.error(name, f"{accessor.count} of {name} for {count} instances")
        count = accessor.count
        values = decode(accessors.read(accessor), accessor.normalized)
        if not np.isfinite(values).all():
            raise attributes.error(name, "expected finite numbers, found others")
        found[name.lower()] = values.tolist()
    if count is None:
        return None
    return [{name: rows[number] for name, rows in found.items()} for number in range(count)]


def as_nodes(
    document: Document, accessors: Accessors, nodes: Iterable[int], limits: Limits
) -> tuple[Document, Buffers] | None:
    """Give each instance of some nodes a node of its own, below the one that places it.

    Returns:
        The document and its buffers, or None if none of the nodes has instances.

    Raises:
        LimitError: the nodes are more than ``limits`` accept.
    """
    draft = Draft(document, accessors.buffers, limits)
    elements = document.root.children("nodes")
    expanded = set()
    count = len(elements)
    for index in nodes:
        node = elements[index]
        found = instances(node, accessors)
        if found is None:
            continue
        expanded.add(index)
        count += len(found)
        limits.check("nodes", count, "nodes, one for each instance", node.pointer)
        kept = {key: node.value[key] for key in ("mesh", "weights") if key in node.value}
        added = [draft.append("nodes", kept | each) for each in found]
        path = ("nodes", index)
        draft.put((*path, "children"), added + node.references("children", len(elements), "node"))
        for key in kept:
            draft.remove((*path, key))
        alone = len(node.value["extensions"]) == 1
        draft.remove((*path, "extensions") if alone else (*path, "extensions", INSTANCING))
    if not expanded:
        return None
    if all(
        extension_of(node, INSTANCING) is None
        for index, node in enumerate(elements)
        if index not in expanded
    ):
        _drop_name(draft, document)
    return draft.finish()


def _drop_name(draft: Draft, document: Document) -> None:
    for key in ("extensionsUsed", "extensionsRequired"):
        names = document.root.texts(key)
        kept = [name for name in names if name != INSTANCING]
        if len(kept) < len(names):
            if kept:
                draft.put((key,), kept)
            else:
                draft.remove((key,))
