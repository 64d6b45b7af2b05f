"""Whether what a glTF says of a mesh holds for its triangles divided."""

from __future__ import annotations

from meshcone.assets.gltf.accessors import Accessors
from meshcone.assets.gltf.element import Element
from meshcone.assets.gltf.primitives import Primitive
from meshcone.errors import InputError

# What these extensions say of a primitive is true of it divided.
_INDIFFERENT = {
    "KHR_materials_variants",
    "KHR_draco_mesh_compression",
    "EXT_mesh_features",
    "EXT_structural_metadata",
}
# What these say of a mesh is: of its author, or of the object that it is.
_INDIFFERENT_OF_MESHES = {"KHR_xmp", "KHR_xmp_json_ld", "MOZ_hubs_components"}

# What attributes of vertices must be, by how their names begin, to have values between two.
_KINDS = {"NORMAL": "VEC3", "TANGENT": "VEC4", "JOINTS_": "VEC4", "WEIGHTS_": "VEC4"}


def check_mesh(mesh: Element) -> None:
    """Check that what extensions say of a mesh holds with some of its triangles divided.

    Raises:
        InputError: naming the extension.
    """
    _check_extensions(mesh, _INDIFFERENT_OF_MESHES)


def check_primitive(primitive: Element) -> None:
    """Check that what extensions say of a primitive holds for its vertices to come.

    Raises:
        InputError: naming the extension.
    """
    _check_extensions(primitive, _INDIFFERENT)
    found = primitive.child("extensions")
    features = found.child("EXT_mesh_features") if found is not None else None
    for each in features.children("featureIds") if features is not None else ():
        if "attribute" not in each.value and "texture" not in each.value:
            raise InputError(
                "feature identifiers are the numbers of vertices, and new vertices have none",
                place=each.pointer,
            )
    metadata = found.child("EXT_structural_metadata") if found is not None else None
    if metadata is not None and "propertyAttributes" in metadata.value:
        raise InputError(
            "property attributes have a value for each vertex, and new vertices have none",
            place=metadata.place("propertyAttributes"),
        )


def check_vertices(primitive: Primitive, accessors: Accessors) -> None:
    """Check that every vertex of a primitive has each attribute, those that nobody reads too.

    Raises:
        InputError: naming an accessor with more or fewer of them, or of another type.
    """
    count = primitive.position.count
    attributes = primitive.element.child("attributes")
    targets = primitive.element.children("targets")
    for holder in (*([attributes] if attributes is not None else []), *targets):
        for name in holder.value:
            index = holder.reference(name, len(accessors.elements), "accessor")
            if index is None:
                continue
            accessor = accessors.describe(index)
            if accessor.count != count:
                raise accessor.element.error(
                    "count",
                    f"{accessor.count:,} of {name[:80]} for {count:,} positions; faces can be "
                    "divided where every vertex has one",
                )
            kinds = [kind for start, kind in _KINDS.items() if name.startswith(start)]
            expected = kinds[0] if kinds and holder is attributes else accessor.kind
            if accessor.kind != expected:
                raise accessor.element.error(
                    "type", f"{name[:80]} must be {expected}, found {accessor.kind}"
                )


def _check_extensions(element: Element, indifferent: set[str]) -> None:
    found = element.child("extensions")
    for name in found.value if found is not None else ():
        if name not in indifferent:
            raise InputError(
                f"'{name[:80]}' may speak of vertices or triangles by their numbers, which are "
                "others where triangles are divided",
                place=element.place("extensions"),
            )
