"""Extensions by name: which say where a surface is, and which leave it where it is."""

from __future__ import annotations

from collections.abc import Iterable

from meshcone.assets.gltf.element import Element
from meshcone.errors import InputError

DRACO = "KHR_draco_mesh_compression"
MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")
INSTANCING = "EXT_mesh_gpu_instancing"
QUANTIZATION = "KHR_mesh_quantization"
VISIBILITY = "KHR_node_visibility"
LEVELS = "MSFT_lod"
RELATIVE_TO_CENTER = "CESIUM_RTC"
MANIFOLD = "EXT_mesh_manifold"
ANIMATION_POINTER = "KHR_animation_pointer"
OUTLINE = "CESIUM_primitive_outline"

_UNDERSTOOD = {INSTANCING, DRACO, *MESHOPT, QUANTIZATION, VISIBILITY, LEVELS, RELATIVE_TO_CENTER}
# What these say is of looks, behaviour or meaning; none moves a vertex or needs to know where
# one is.
_APART_PREFIXES = (
    "KHR_materials_",
    "KHR_texture_",
    "KHR_audio",
    "KHR_node_",
    "KHR_xmp",
    "EXT_texture_",
    "EXT_lights_",
    "MSFT_texture_",
    "MSFT_packing_",
    "VRM",
)
_APART = {
    "KHR_lights_punctual",
    ANIMATION_POINTER,
    "KHR_interactivity",
    "EXT_feature_metadata",
    "EXT_mesh_features",
    MANIFOLD,
    "EXT_structural_metadata",
    OUTLINE,
    "FB_ngon_encoding",
    "MOZ_hubs_components",
    "GODOT_single_root",
}


def unknown_extensions(root: Element) -> tuple[str, ...]:
    """Names that a document requires and of which nothing is known here."""
    return tuple(
        dict.fromkeys(
            name
            for name in root.texts("extensionsRequired")
            if name not in _UNDERSTOOD | _APART and not name.startswith(_APART_PREFIXES)
        )
    )


def check_untouched(root: Element, unknown: tuple[str, ...], primitives: Iterable[Element]) -> None:
    """Check that writing positions cannot contradict what an unknown extension says of them.

    Args:
        root: the document.
        unknown: the extensions.
        primitives: those whose positions are written.

    Raises:
        InputError: one speaks of such a primitive, or of any accessor, buffer view or buffer.
    """
    if not unknown:
        return
    arrays = ("accessors", "bufferViews", "buffers")
    data = (each for array in arrays for each in root.children(array))
    for element in (*primitives, *data):
        found = element.child("extensions")
        for name in found.value if found is not None else ():
            if name in unknown:
                raise InputError(
                    f"the file requires the extension '{name[:80]}', which is not known here and "
                    "may say where vertices are: it can be measured, not refined",
                    place=element.place("extensions"),
                )


def extension_of(element: Element, name: str) -> Element | None:
    """What an extension says of an object."""
    found = element.child("extensions")
    return None if found is None else found.child(name)
