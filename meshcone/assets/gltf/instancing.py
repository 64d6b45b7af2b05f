"""Meshes that a node places many times (EXT_mesh_gpu_instancing).

Source: the extension's text in the Khronos glTF repository.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Any

import numpy as np

from meshcone.assets.gltf.accessors import Accessors, decode
from meshcone.assets.gltf.buffers import Buffers
from meshcone.assets.gltf.document import Document
from meshcone.assets.gltf.draft import Draft
from meshcone.assets.gltf.element import Element
from meshcone.assets.gltf.extensions import INSTANCING, extension_of
from meshcone.assets.gltf.references import Naming, meshes_of_nodes_named, pointer_of
from meshcone.assets.limits import Limits
from meshcone.errors import InputError

_KINDS = {"TRANSLATION": "VEC3", "ROTATION": "VEC4", "SCALE": "VEC3"}


def instances(node: Element, accessors: Accessors) -> list[dict[str, Any]] | None:
    """The transform of each instance, as a node below the given one would have it.

    A skin puts a mesh where its joints are, whatever transforms the node has, so those of
    instances too say nothing there.

    Returns:
        Members of a node for each; None if the node does not use the extension, or has a skin.

    Raises:
        InputError: the extension is malformed.
    """
    extension = None if "skin" in node.value else extension_of(node, INSTANCING)
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
    document: Document, accessors: Accessors, nodes: Collection[int], limits: Limits
) -> tuple[Document, Buffers] | None:
    """Give each instance of some nodes a node of its own, below the one that places it.

    Returns:
        The document and its buffers, or None if none of the nodes has instances.

    Raises:
        InputError: there is more to be said of an instance than where it is.
        LimitError: the nodes are more than ``limits`` accept.
    """
    draft = Draft(document, accessors.buffers, limits)
    elements = document.root.children("nodes")
    named = _named(document, nodes)
    expanded = set()
    count = len(elements)
    for index in nodes:
        node = elements[index]
        found = instances(node, accessors)
        if found is None:
            continue
        more = _beyond_places(document.root, index, named)
        if more is not None:
            raise more
        expanded.add(index)
        count += len(found)
        limits.check("nodes", count, "nodes, one for each instance", node.pointer)
        kept = {key: node.value[key] for key in ("mesh", "weights") if key in node.value}
        added = [draft.append("nodes", kept | _turned(each)) for each in found]
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


def _turned(members: dict[str, Any]) -> dict[str, Any]:
    """The members of a node whose rotation is of length 1, which it need not be in few bits."""
    if "rotation" not in members:
        return members
    rotation = np.array(members["rotation"])
    return members | {"rotation": (rotation / np.linalg.norm(rotation)).tolist()}


def not_as_nodes(document: Document, nodes: Collection[int]) -> set[int]:
    """Those of some nodes with instances of which more is said than nodes could say."""
    named = _named(document, nodes)
    return {index for index in nodes if _beyond_places(document.root, index, named) is not None}


def _named(document: Document, nodes: Collection[int]) -> list[Naming]:
    """What is said of meshes by the nodes that have them, if some of these have instances."""
    elements = document.root.children("nodes")
    placing = any(extension_of(elements[index], INSTANCING) for index in nodes)
    return meshes_of_nodes_named(document.root) if placing else []


def _beyond_places(root: Element, index: int, named: list[Naming]) -> InputError | None:
    """What a node says of its instances besides where they are, as the reason not to lose it."""
    node = root.children("nodes")[index]
    extension = extension_of(node, INSTANCING)
    attributes = None if extension is None else extension.child("attributes")
    if extension is None or attributes is None:
        return None
    said = [
        *((name, attributes.place(name)) for name in attributes.value if name not in _KINDS),
        *((name, extension.place(name)) for name in extension.value if name != "attributes"),
        *((name, node.place("extensions")) for name in _others_about_instances(node)),
        *_moved(root, index),
        *((each.extension, each.place) for each in named if each.may_be(index)),
    ]
    if not said:
        return None
    name, place = said[0]
    return InputError(
        f"'{name[:80]}' is about the instances of node {index}, which do not all move alike, and "
        "would be lost where each becomes a node; leave them out with 'select', or remove it",
        place=place,
    )


def _others_about_instances(node: Element) -> Iterator[str]:
    found = node.child("extensions")
    for name in found.value if found is not None else ():
        if name != INSTANCING and "instance" in name.lower():
            yield name


def _moved(root: Element, index: int) -> Iterator[tuple[str, str]]:
    """What animations move of a node that would leave it: its mesh's weights, and instances."""
    start = f"/nodes/{index}/"
    left = {"weights": f"{start}weights/", INSTANCING: f"{start}extensions/{INSTANCING}/"}
    for animation in root.children("animations"):
        for channel in animation.children("channels"):
            target = channel.child("target")
            if target is None:
                continue
            if target.value.get("node") == index and target.value.get("path") == "weights":
                yield "weights", target.pointer
            named = f"{pointer_of(channel) or ''}/"
            yield from ((name, target.pointer) for name in left if named.startswith(left[name]))


def _drop_name(draft: Draft, document: Document) -> None:
    for key in ("extensionsUsed", "extensionsRequired"):
        names = document.root.texts(key)
        kept = [name for name in names if name != INSTANCING]
        if len(kept) < len(names):
            if kept:
                draft.put((key,), kept)
            else:
                draft.remove((key,))
