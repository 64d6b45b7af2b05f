"""Which values are distances, and what they are in model units.

A distance in a report is relative to the reference's radius, but for those of the alignment;
a bound in model units is for these alone.
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


def is_distance(key: str) -> bool:
    """Whether the value a gate names is a distance, relative to the radius."""
    for section in ("quality.input.", "quality.refined.", "quality.floor."):
        key = key.removeprefix(section)
    return key.partition(".")[0] in _DISTANCES and not key.endswith("_model")
