"""Which values are distances, and what they are in model units.

A distance in a report is relative to the reference's radius, but for those of the alignment and
the size of an asset; a bound in model units is for distances alone.

A glTF is in metres (glTF 2.0, section 3.4), so that a bound in millimetres is converted. What the
unit of another file is nobody knows but whoever made it: there a unit is a name.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

# In metres.
LENGTHS: Mapping[str, float] = {
    "m": 1.0,
    "mm": 0.001,
    "cm": 0.01,
    "um": 1e-6,
    "km": 1000.0,
    "in": 0.0254,
    "ft": 0.3048,
}
GLTF_FORMATS = ("glb", "gltf")
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


@dataclass(frozen=True)
class Unit:
    """What lengths are told in.

    Attributes:
        name: of the unit.
        length: of one, in the unit of the files.
    """

    name: str
    length: float = 1.0


def unit_for(named: str | None, *formats: str) -> Unit:
    """The unit that a bound in model units is in.

    Args:
        named: what a gate calls it, if it does.
        formats: of the files whose sizes count. Metres where one of them is a glTF, and a name
            that is no length is then not taken; else what the gate calls it, or "units", but
            millimetres where one of them is a STEP.
    """
    if not any(each in GLTF_FORMATS for each in formats):
        return Unit(named or ("mm" if "step" in formats else "units"))
    if named is None or named not in LENGTHS:
        return Unit("m")
    return Unit(named, LENGTHS[named])


def sized(source: str, reference: str | None, *, scaled: bool) -> tuple[str, ...]:
    """Formats of the files whose sizes count for a distance between them.

    Args:
        source: the source's format.
        reference: the reference's, if there is one.
        scaled: whether the source takes the reference's size before it is measured.
    """
    if reference is None:
        return (source,)
    return (reference,) if scaled else (reference, source)


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
