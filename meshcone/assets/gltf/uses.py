"""What in a document reads an accessor, and as what; which buffer views extensions read."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from meshcone.assets.gltf.element import Element
from meshcone.assets.gltf.extensions import INSTANCING, MANIFOLD, OUTLINE, extension_of

# Members that are buffer views in EXT_structural_metadata, and in what is named as in glTF itself.
_VIEW_KEYS = {"bufferView", "values", "arrayOffsets", "stringOffsets"}


@dataclass(frozen=True)
class Use:
    """Something that reads an accessor.

    Attributes:
        holder: the object that names the accessor.
        name: the member of it that does.
        accessor: index of the accessor.
        mesh: index of the mesh one of whose vertex attributes it is; None for anything else, morph
            targets too.
    """

    holder: Element
    name: str
    accessor: int
    mesh: int | None = None


def accessor_uses(root: Element, count: int) -> Iterator[Use]:
    """Every use of an accessor that is known of.

    Args:
        root: the document.
        count: how many accessors it has.

    Raises:
        InputError: one is named that is not there.
    """
    for index, mesh in enumerate(root.children("meshes")):
        for _, primitive in drawn_or_described(mesh):
            yield from uses_of_primitive(primitive, count, index)
        manifold = extension_of(mesh, MANIFOLD)
        if manifold is not None:
            yield from _named(manifold, ("mergeIndices", "mergeValues"), count)
    for animation in root.children("animations"):
        for sampler in animation.children("samplers"):
            yield from _named(sampler, ("input", "output"), count)
    for skin in root.children("skins"):
        yield from _named(skin, ("inverseBindMatrices",), count)
    for node in root.children("nodes"):
        instancing = extension_of(node, INSTANCING)
        attributes = instancing.child("attributes") if instancing is not None else None
        if attributes is not None:
            yield from _named(attributes, attributes.value, count)


def uses_of_primitive(primitive: Element, count: int, mesh: int | None = None) -> Iterator[Use]:
    """Every use of an accessor by a primitive. Raises as ``accessor_uses`` does."""
    attributes = primitive.child("attributes")
    if attributes is not None:
        yield from _named(attributes, attributes.value, count, mesh)
    for target in primitive.children("targets"):
        yield from _named(target, target.value, count)
    yield from _named(primitive, ("indices",), count)
    outline = extension_of(primitive, OUTLINE)
    if outline is not None:
        yield from _named(outline, ("indices",), count)


def drawn_or_described(mesh: Element) -> Iterator[tuple[tuple[str | int, ...], Element]]:
    """The primitives of a mesh, and the one that an extension says is the whole of it.

    Yields:
        Where it is in the mesh, and it.
    """
    for number, primitive in enumerate(mesh.children("primitives")):
        yield ("primitives", number), primitive
    whole = manifold_of(mesh)
    if whole is not None:
        yield ("extensions", MANIFOLD, "manifoldPrimitive"), whole


def manifold_of(mesh: Element) -> Element | None:
    """The primitive that EXT_mesh_manifold says is the whole of a mesh; nothing draws it."""
    manifold = extension_of(mesh, MANIFOLD)
    return None if manifold is None else manifold.child("manifoldPrimitive")


def views_of_extensions(root: Element) -> Iterator[int]:
    """Buffer views in what extensions of the root say, such as tables of properties and sounds."""
    extensions = root.child("extensions")
    if extensions is not None:
        yield from _named_views(extensions.value)


def _named_views(value: object) -> Iterator[int]:
    if isinstance(value, dict):
        for name, each in value.items():
            if name in _VIEW_KEYS and isinstance(each, int) and not isinstance(each, bool):
                yield each
            else:
                yield from _named_views(each)
    elif isinstance(value, list):
        for each in value:
            yield from _named_views(each)


def _named(
    holder: Element, names: Iterable[str], count: int, mesh: int | None = None
) -> Iterator[Use]:
    for name in names:
        index = holder.reference(name, count, "accessor")
        if index is not None:
            yield Use(holder, name, index, mesh)
