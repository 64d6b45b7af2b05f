"""The notices about a scene that was read: each says what was found, where, and how often."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass

from meshcone.assets.astray import astray
from meshcone.assets.gltf.accessors import Accessor
from meshcone.assets.gltf.document import Document
from meshcone.assets.gltf.element import Element
from meshcone.assets.gltf.nodes import Placements
from meshcone.notices import Code, Notice

_OTHER_SCENES = "not the default: not read, and left as {it is|they are}; see the option scene"
_GATHERED = "skinned: {its|their} instances are not read, and left as they are"
_NAMED = 3  # of a list in a sentence
_TYPES: dict[object, str] = {
    5120: "BYTE",
    5121: "UNSIGNED_BYTE",
    5122: "SHORT",
    5123: "UNSIGNED_SHORT",
    5125: "UNSIGNED_INT",
    5126: "FLOAT",
}
_LEFT = "not shown, not read, and left as {it is|they are}"


@dataclass(frozen=True)
class Findings:
    """What was found on the way through a scene.

    Attributes:
        placements: the meshes of the scene.
        scenes: other scenes, which are not read.
        skinned, morphed: meshes with a skin and with morph targets.
        empty: primitives that draw nothing.
        ragged: primitives with indices left over.
        astray: how many vertices have no finite coordinates.
        undrawn: how many triangles use one of those.
    """

    placements: Placements
    scenes: list[int]
    skinned: Collection[int]
    morphed: Collection[int]
    empty: list[Element]
    ragged: list[Element]
    astray: int
    undrawn: int


def scene_notices(document: Document, found: Findings) -> tuple[Notice, ...]:
    """One sentence for each kind of finding, however many there are."""
    return tuple(_notices(document, found))


def miscounted_notices(accessors: Collection[Accessor]) -> tuple[Notice, ...]:
    """That accessors declare other counts than what is decompressed for them has."""
    if not accessors:
        return ()
    words = "declaring another count than its Draco data hold, which counts"
    first = min(accessors, key=lambda accessor: accessor.index)
    others = f" and {len(accessors) - 1:,} more" if len(accessors) > 1 else ""
    return (Notice(Code.ACCESSORS_COUNT, f"accessor {first.index}{others}: {words}"),)


def storage_notices(before: Element, after: Element) -> Iterator[Notice]:
    """What of a document is stored in another way in the one that was made of it.

    Args:
        before: the root of the document.
        after: that of the other, which has all that was there under the same index.
    """
    accessors = list(zip(before.children("accessors"), after.children("accessors"), strict=False))
    types = [
        f"accessor {number} ({_TYPES.get(old, old)} to {_TYPES.get(new, new)})"
        for number, (one, other) in enumerate(accessors)
        if (old := one.value.get("componentType")) != (new := other.value.get("componentType"))
    ]
    full = [
        f"accessor {number}"
        for number, (one, other) in enumerate(accessors)
        if "sparse" in one.value and "sparse" not in other.value
    ]
    buffers = zip(before.children("buffers"), after.children("buffers"), strict=False)
    moved = [
        f"'{uri[:60]}'"
        for one, other in buffers
        if (uri := _file_of(one)) is not None and _file_of(other) is None
    ]
    for found, words in (
        (types, "stored in another type: {}"),
        (full, "sparse, and stored in full: {}"),
        (moved, "buffers that were files of their own, and are data in the document: {}"),
    ):
        if found:
            more = f" and {len(found) - _NAMED:,} more" if len(found) > _NAMED else ""
            listed = ", ".join(found[:_NAMED]) + more
            yield Notice(Code.WRITING_STORAGE, words.format(listed))


def _file_of(buffer: Element) -> str | None:
    """The URI of a buffer that is a file of its own."""
    uri = buffer.text("uri")
    return None if uri is None or uri[:5].lower() == "data:" else uri


def _notices(document: Document, found: Findings) -> Iterator[Notice]:
    nodes, meshes, scenes = map(document.root.children, ("nodes", "meshes", "scenes"))
    placements = found.placements
    bare = {p.mesh for p in placements.shown if not meshes[p.mesh].children("primitives")}
    for code, array, indices, words in (
        (Code.NODES_INVISIBLE, nodes, placements.invisible, f"switched off: {_LEFT}"),
        (Code.NODES_FLATTENED, nodes, placements.flattened, f"scaled to a line or point: {_LEFT}"),
        (Code.NODES_LEVEL, nodes, placements.levels, f"of another level of detail: {_LEFT}"),
        (Code.SKIN_INSTANCES, nodes, placements.gathered, _GATHERED),
        (
            Code.SCENES_OTHER,
            scenes,
            found.scenes,
            _OTHER_SCENES,
        ),
        (Code.MESHES_EMPTY, meshes, bare, "without primitives: nothing is drawn"),
        (Code.SKIN_BIND_POSE, meshes, found.skinned, "skinned: read in {its|their} bind pose"),
        (
            Code.MORPH_BASE_SHAPE,
            meshes,
            found.morphed,
            "with morph targets: read in {its|their} base shape, the targets stay as they are",
        ),
    ):
        if indices:
            kind = "scene" if array is scenes else "node" if array is nodes else "mesh"
            yield _about(code, kind, [array[index] for index in sorted(set(indices))], words)
    for code, elements, words in (
        (Code.PRIMITIVES_EMPTY, found.empty, "without vertices or enough indices: not drawn"),
        (Code.INDICES_LEFT_OVER, found.ragged, "with indices left over, which make no triangle"),
    ):
        if elements:
            yield _about(code, "primitive", elements, words)
    for name in document.unknown:
        words = f"requires the extension '{name[:80]}', which is not known here: read as if it "
        yield Notice(Code.EXTENSIONS_UNKNOWN, words + "moved no vertex")
    if placements.origin.any():
        place = ", ".join(f"{value:,.10g}" for value in placements.origin)
        words = f"CESIUM_RTC puts the scene at ({place}), and there it is read"
        yield Notice(Code.SCENE_RELATIVE, words)
    yield from astray(found.astray, found.undrawn)


_PLURALS = {"scene": "scenes", "node": "nodes", "mesh": "meshes", "primitive": "primitives"}


def _about(code: Code, kind: str, elements: list[Element], words: str) -> Notice:
    """A sentence about one or many; ``{a|b}`` in its words is a for one and b for many."""
    many = len(elements) > 1
    first = called(kind, elements[0])
    start = f"{len(elements):,} {_PLURALS[kind]}, {first} the first, are" if many else f"{first} is"
    for choice in _choices(words):
        one, _, other = choice[1:-1].partition("|")
        words = words.replace(choice, other if many else one)
    return Notice(code, f"{start} {words}")


def _choices(words: str) -> Iterator[str]:
    while "{" in words:
        start, end = words.index("{"), words.index("}") + 1
        yield words[start:end]
        words = words[end:]


def called(kind: str, element: Element) -> str:
    """How messages call an object: by its name, or by its number."""
    name = element.value.get("name")
    number = element.pointer.rpartition("/")[2]
    if kind == "primitive":
        mesh = element.pointer.split("/")[2]
        return f"primitive {number} of mesh {mesh}"
    return f"{kind} '{name[:60]}'" if isinstance(name, str) and name else f"{kind} {number}"
