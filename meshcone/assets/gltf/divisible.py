"""Whether what a glTF says of a mesh holds for its triangles divided."""

from __future__ import annotations

from meshcone.assets.gltf.element import Element
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


def _check_extensions(element: Element, indifferent: set[str]) -> None:
    found = element.child("extensions")
    for name in found.value if found is not None else ():
        if name not in indifferent:
            raise InputError(
                f"'{name[:80]}' may speak of vertices or triangles by their numbers, which are "
                "others where triangles are divided",
                place=element.place("extensions"),
            )
