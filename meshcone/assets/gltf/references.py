"""What a document says of a mesh by its number, which would not be said of a copy of the mesh."""

from __future__ import annotations

import copy
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from meshcone.assets.gltf.draft import Draft
from meshcone.assets.gltf.element import Element
from meshcone.assets.gltf.extensions import ANIMATION_POINTER, extension_of

_POINTER = re.compile(r"/meshes(?:/([^/]*)(?:/|$)|$)")
_MEMBER = re.compile(r"/(?:mesh|meshes/\d+)$")
_NUMBER = re.compile(r"0|[1-9]\d*")
_MESH_OF_NODE = ("morphTargetBinds", "meshAnnotations")  # of VRM 1.0


@dataclass(frozen=True)
class Naming:
    """Something in an extension that names a mesh or a node by its number.

    Attributes:
        number: that; None where it may be any.
        extension: the name of the extension.
        place: JSON pointer to it.
    """

    number: int | None
    extension: str
    place: str

    def may_be(self, number: int) -> bool:
        """Whether it may name this one."""
        return self.number is None or self.number == number


def meshes_named(root: Element) -> list[Naming]:
    """Every name of a mesh in extensions, but for what animations move, which copies get too.

    A member ``mesh`` or ``meshes`` with numbers is one, as in VRM 0.x and in shapes for physics,
    and a JSON pointer to a mesh, as in KHR_interactivity.
    """
    found = []
    for extension, place, value in _said(root):
        if _MEMBER.search(place) and isinstance(value, int) and not isinstance(value, bool):
            found.append(Naming(value, extension, place))
        elif isinstance(value, str) and extension != ANIMATION_POINTER:
            pointer = _POINTER.match(value)
            if pointer:
                whole = _NUMBER.fullmatch(pointer[1] or "")
                number = int(whole[0]) if whole else None  # a template has a word there
                found.append(Naming(number, extension, place))
    return found


def meshes_of_nodes_named(root: Element) -> list[Naming]:
    """Every name of a node, in VRM 1.0, that is about the mesh the node has."""
    return [
        Naming(value, extension, place)
        for extension, place, value in _said(root)
        if isinstance(value, int)
        and place.endswith("/node")
        and any(f"/{holder}/" in place for holder in _MESH_OF_NODE)
    ]


def animate_copy(draft: Draft, root: Element, mesh: int, added: int) -> None:
    """Let animations move a copy of a mesh as they move the mesh.

    Args:
        draft: takes the changes.
        root: the document.
        mesh: the mesh.
        added: its copy.
    """
    start = f"/meshes/{mesh}/"
    for number, animation in enumerate(root.children("animations")):
        for channel in animation.children("channels"):
            named = pointer_of(channel) or ""
            if named.startswith(start):
                value: Any = copy.deepcopy(channel.value)
                general = value["target"]["extensions"][ANIMATION_POINTER]
                general["pointer"] = f"/meshes/{added}/{named.removeprefix(start)}"
                draft.extend(("animations", number, "channels"), value)


def pointer_of(channel: Element) -> str | None:
    """What a channel of an animation moves, where it says so by a JSON pointer."""
    target = channel.child("target")
    general = None if target is None else extension_of(target, ANIMATION_POINTER)
    return None if general is None else general.text("pointer")


def _said(root: Element) -> Iterator[tuple[str, str, object]]:
    """Every value in an extension: the extension's name, a JSON pointer, and the value."""
    open_values: list[tuple[str, str, object]] = [("", "", root.value)]
    while open_values:
        extension, place, value = open_values.pop()
        if isinstance(value, dict):
            here = Element(value, place)
            for name, each in value.items():
                inner = name if place.endswith("/extensions") else extension
                if name != "extras":
                    open_values.append((inner, here.place(name), each))
        elif isinstance(value, list):
            open_values += [(extension, f"{place}/{n}", each) for n, each in enumerate(value)]
        elif extension:
            yield extension, place, value
