"""Which values are distances, and what they are in model units.

A distance in a report is relative to the reference's radius, but for those of the alignment and
the size of an asset; a bound in model units is for distances alone.
"""

from __future__ import annotations

_DISTANCES = frozenset(
    {
        "point_to_surface",
        "chamfer_l1",
        "hausdorff",
        "hausdorff95",
        "emd",
        "displacement",
        "deviation",
    }
)
_SIZES = frozenset({"size.width", "size.height", "size.depth", "size.diagonal"})
_DIRECTED = frozenset({"mean", "rms", "p5", "p95", "max", "upper"})


def unit_of(file_format: str) -> str:
    """What messages call the unit of a file: metres in a glTF (glTF 2.0, section 3.4)."""
    return "m" if file_format in ("glb", "gltf") else "units"


def is_distance(key: str) -> bool:
    """Whether the value a gate names is a distance, relative to the radius."""
    if key.startswith("quality.directions."):
        return key.rpartition(".")[2] in _DIRECTED
    for section in ("quality.input.", "quality.refined.", "quality.floor."):
        key = key.removeprefix(section)
    if key.endswith("_model") or key.startswith("deviation.area_beyond"):
        return False
    return key.partition(".")[0] in _DISTANCES


def is_size(key: str) -> bool:
    """Whether the value a gate names is a length in model units, as the report states it."""
    first, _, rest = key.partition(".")
    for side in ("source.", "reference.", "refined."):
        rest = rest.removeprefix(side)
    return first == "asset" and rest in _SIZES
