"""Primitives as a document compresses them, each with accessors of its own."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from meshcone.assets.gltf.accessors import Accessor, Accessors
from meshcone.assets.gltf.buffers import Buffers
from meshcone.assets.gltf.document import Document
from meshcone.assets.gltf.draft import Draft
from meshcone.assets.gltf.element import Element
from meshcone.assets.gltf.extensions import DRACO
from meshcone.assets.gltf.splice import Path
from meshcone.assets.limits import Limits
from meshcone.errors import InputError

_TRIANGLES = 4
_STORED = ("bufferView", "byteOffset", "sparse")


@dataclass(frozen=True)
class DracoPrimitive:
    """A primitive as its document compresses it.

    Attributes:
        mesh, number: which primitive of which mesh.
        view: buffer view of the bitstream.
        indices: its index accessor.
        attributes: accessor and unique id by attribute.
    """

    element: Element
    mesh: int
    number: int
    view: int
    indices: Accessor
    attributes: dict[str, tuple[Accessor, int]]

    @property
    def has_copy(self) -> bool:
        """Whether all that is compressed is stored plainly as well."""
        return all(accessor.dense for _, accessor in self.filled())

    def filled(self) -> Iterator[tuple[Path, Accessor]]:
        """What a bitstream fills, each with where the document names it."""
        path = ("meshes", self.mesh, "primitives", self.number)
        yield (*path, "indices"), self.indices
        for name, (accessor, _) in self.attributes.items():
            yield (*path, "attributes", name), accessor

    @property
    def vertices(self) -> int:
        """How many vertices are declared."""
        return self.attributes["POSITION"][0].count


def draco_primitives(document: Document, accessors: Accessors) -> list[DracoPrimitive]:
    """Every compressed primitive of a document.

    Raises:
        InputError: the extension is malformed, or used on what is no list of triangles.
    """
    return [
        _read(accessors, primitive, extension, mesh, number)
        for mesh, element in enumerate(document.root.children("meshes"))
        for number, primitive in enumerate(element.children("primitives"))
        if (extension := _extension(primitive)) is not None
    ]


def separated(document: Document, buffers: Buffers, limits: Limits) -> Document:
    """Give every bitstream accessors that no other bitstream fills.

    Exporters let meshes share an accessor whose values were equal, and then compress each of
    them in an order of its own. Viewers take what each bitstream holds.

    Returns:
        The document, with copies of shared accessors appended; itself where none is shared.

    Raises:
        InputError: the extension is malformed.
        LimitError: the document grows larger than ``limits`` accept.
    """
    accessors = Accessors(document, buffers, limits)
    draft = Draft(document, buffers, limits)
    filled_by: dict[int, int] = {}
    copies: dict[tuple[int, int], int] = {}
    indices_of: dict[int, int] = {}
    changed = False
    for primitive in draco_primitives(document, accessors):
        if primitive.has_copy:
            continue
        for path, accessor in primitive.filled():
            view, index = primitive.view, accessor.index
            if path[-1] == "indices":
                index = indices_of.setdefault(view, index)
            if filled_by.setdefault(index, view) != view:
                if (view, index) not in copies:
                    value = accessors.elements[index].value
                    kept = {key: each for key, each in value.items() if key not in _STORED}
                    copies[view, index] = draft.append("accessors", kept)
                index = copies[view, index]
            if index != accessor.index:
                draft.put(path, index)
                changed = True
    return draft.finish()[0] if changed else document


def _extension(primitive: Element) -> Element | None:
    extensions = primitive.child("extensions")
    return None if extensions is None else extensions.child(DRACO)


def _read(
    accessors: Accessors,
    primitive: Element,
    extension: Element,
    mesh: int,
    number: int,
) -> DracoPrimitive:
    mode = primitive.integer("mode")
    if mode not in (None, _TRIANGLES):
        raise primitive.error("mode", f"'{DRACO}' is supported for lists of triangles only")
    count = len(accessors.elements)
    view = extension.reference("bufferView", len(accessors.views), "buffer view")
    indices = primitive.reference("indices", count, "accessor")
    stored, declared = extension.child("attributes"), primitive.child("attributes")
    if view is None or indices is None or stored is None or declared is None:
        missing = "bufferView, attributes and the primitive's indices"
        raise InputError(f"'{DRACO}' needs {missing}", place=extension.pointer)
    attributes = {}
    for name in stored.value:
        index = declared.reference(name, count, "accessor")
        if index is None:
            raise stored.error(name, f"compresses '{name[:40]}', which the primitive has not")
        attributes[name] = (accessors.describe(index), stored.required_integer(name))
    if "POSITION" not in attributes:
        raise InputError(f"'{DRACO}' without POSITION is not supported", place=stored.pointer)
    found = DracoPrimitive(primitive, mesh, number, view, accessors.describe(indices), attributes)
    for name, (accessor, _) in attributes.items():
        if accessor.sparse and not found.has_copy:
            raise accessor.element.error("sparse", f"is not supported together with '{DRACO}'")
        if accessor.count != found.vertices:
            raise accessor.element.error(
                "count", f"{accessor.count:,} of {name} for {found.vertices:,} positions"
            )
    return found
