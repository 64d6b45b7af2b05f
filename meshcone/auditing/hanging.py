"""What hangs at the nodes of two files: meshes, skins, cameras, lights, and whether they are shown.

A file can list a skin that no node has any more, and then skins nothing.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from meshcone.assets.content import Content, Node


class Rehung(NamedTuple):
    """One thing that hangs otherwise: the kind it is counted as, where, and both sides."""

    what: str
    where: str
    words: str
    before: str
    after: str


@dataclass(frozen=True)
class _Kind:
    """A kind of thing that hangs at nodes.

    Attributes:
        one: what one of them is called.
        counted: the kind of thing that is altered where it hangs otherwise.
        names: of all that a file lists.
        at: which of them a node has.
    """

    one: str
    counted: str
    names: Callable[[Content], Sequence[str]]
    at: Callable[[Node], int | None]


def _skin(node: Node) -> int | None:
    """A skin moves the mesh at its node, and without one nothing."""
    return node.skin if node.mesh is not None else None


_KINDS = (
    _Kind("mesh", "nodes", lambda c: [each.name for each in c.meshes], lambda node: node.mesh),
    _Kind("skin", "skins", lambda c: [each.name for each in c.skins], _skin),
    _Kind("camera", "cameras", lambda c: [each.name for each in c.cameras], lambda n: n.camera),
    _Kind("light", "lights", lambda c: [each.name for each in c.lights], lambda node: node.light),
)
_SKINS = _KINDS[1]


def reached(content: Content) -> list[int]:
    """Nodes that a scene reaches."""
    return [number for number, node in enumerate(content.nodes) if node.depth]


def rehung(
    old: Content, new: Content, old_nodes: Mapping[str, int], new_nodes: Mapping[str, int]
) -> Iterator[Rehung]:
    """What hangs otherwise at nodes that both files have.

    Things are told apart by names that both files have, so that another order is no difference.
    What the other file does not list at all is told where things are listed.

    Args:
        old: what the reference holds.
        new: what the source holds.
        old_nodes: indices of the reference's nodes, by path.
        new_nodes: those of the source.
    """
    both = [(path, old_nodes[path], new_nodes[path]) for path in old_nodes if path in new_nodes]
    found = [each for kind in _KINDS for each in _of_kind(kind, old, new, both)]
    yield from found
    if not any(each.what == _SKINS.counted for each in found):
        yield from _unskinned(old, new)
    instances = _instances(old), _instances(new)
    for path, before, after in both:
        was, now = old.nodes[before], new.nodes[after]
        if was.hidden != now.hidden:
            shown = ["hidden" if each.hidden else "shown" for each in (was, now)]
            yield _differs(path, "visibility", *shown)
        if left := set(was.extensions) - set(now.extensions):
            yield _differs(path, "extensions", ", ".join(sorted(left)), "none")
        drawn = instances[0].get(before), instances[1].get(after)
        if None not in drawn and drawn[0] != drawn[1]:
            yield _differs(path, "number of instances", str(drawn[0]), str(drawn[1]))


def _of_kind(
    kind: _Kind, old: Content, new: Content, both: Sequence[tuple[str, int, int]]
) -> Iterator[Rehung]:
    names = kind.names(old), kind.names(new)
    shared = set(names[0]) & set(names[1]) - {""}
    counts = Counter(names[0]), Counter(names[1])
    for path, before, after in both:
        numbers = kind.at(old.nodes[before]), kind.at(new.nodes[after])
        called = [
            None if number is None else of_side[number]
            for number, of_side in zip(numbers, names, strict=True)
        ]
        was, now = ("none" if n is None else n if n in shared else "another" for n in called)
        if was == now:
            continue
        if now == "none" and counts[0][called[0] or ""] > counts[1][called[0] or ""]:
            continue  # the source lists it no more, which is told
        if was == "none" and counts[1][called[1] or ""] > counts[0][called[1] or ""]:
            continue
        told = ["none" if name is None else name or "one without a name" for name in called]
        if kind.counted == "nodes":
            yield _differs(path, kind.one, *told)
        else:
            words = "is at its node no more" if now == "none" else f"is {told[1]} at its node"
            yield Rehung(kind.counted, path, f"{words}; the reference has {told[0]}", *told)


def _unskinned(old: Content, new: Content) -> Iterator[Rehung]:
    """Meshes that a skin moves in one of both files only, at whatever nodes they are."""
    listed = {mesh.name for mesh in old.meshes} & {mesh.name for mesh in new.meshes}
    if len(old.skins) != len(new.skins):
        return  # which is told
    before, after = (
        {
            content.meshes[node.mesh].name
            for node in content.nodes
            if node.depth and node.mesh is not None and node.skin is not None
        }
        for content in (old, new)
    )
    for name in sorted((before ^ after) & listed):
        was, now = ("a skin" if name in side else "none" for side in (before, after))
        words = f"moves this mesh in one file only: the reference has {was}"
        yield Rehung("skins", name, words, was, now)


def _instances(content: Content) -> dict[int, int]:
    """How many times each node draws its mesh, by the node's index."""
    drawn = Counter((each.node, each.primitive) for each in content.draws)
    return {node: count for (node, _), count in drawn.items() if node is not None}


def _differs(path: str, of: str, before: str, after: str) -> Rehung:
    words = f"differs in {of}: {after}; the reference has {before}"
    return Rehung("nodes", path, words, before, after)
