"""What the slots of materials hold: colours, which are stored as sRGB, or data, which are not.

Sources: glTF 2.0, section 3.9, and the extensions KHR_materials_anisotropy, _clearcoat,
_diffuse_transmission, _iridescence, _pbrSpecularGlossiness, _sheen, _specular, _transmission and
_volume; for an OBJ "MTL material format", Alias|Wavefront 1995, and what exporters add to it.
"""

from __future__ import annotations

from collections.abc import Iterable

BASE_COLOR = "base_color"
NORMALS = frozenset({"normal", "clearcoatNormalTexture"})

_COLORS = frozenset(
    {
        BASE_COLOR,
        "emissive",
        "diffuseTexture",
        "specularGlossinessTexture",
        "specularColorTexture",
        "sheenColorTexture",
        "diffuseTransmissionColorTexture",
        "ambient",
        "specular",
    }
)
_DATA = NORMALS | {
    "metallic_roughness",
    "occlusion",
    "anisotropyTexture",
    "clearcoatTexture",
    "clearcoatRoughnessTexture",
    "iridescenceTexture",
    "iridescenceThicknessTexture",
    "transmissionTexture",
    "thicknessTexture",
    "shininess",
    "roughness",
    "metallic",
    "bump",
    "displacement",
}
# All others agree with either: alpha is linear in an sRGB image too, so that sheenColorTexture
# and sheenRoughnessTexture share one, as do specularTexture and diffuseTransmissionTexture with
# their colours, and map_d with map_Kd. Of an extension that is not known nobody can say.


def are_color_and_data(slots: Iterable[str]) -> bool:
    """Whether some of these slots take an image for colours, and others the same channels for data.

    Args:
        slots: without the names of their extensions.
    """
    found = frozenset(slots)
    return not found.isdisjoint(_COLORS) and not found.isdisjoint(_DATA)
