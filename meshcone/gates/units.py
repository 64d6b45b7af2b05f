"""Which values are distances, and what they are in model units.

A distance in a report is relative to the reference's radius, but for those of the alignment and
the size of an asset; a bound in model units is for distances alone.

A glTF is in metres (glTF 2.0, section 3.4) and a STEP is read in millimetres, so that a bound in
another length is converted. What the unit of another file is nobody knows but whoever made it:
there a unit is a name.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import PurePosixPath

from meshcone.errors import InputError
from meshcone.suggestions import did_you_mean

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
_STEP_FORMATS = ("step",)
_USD_FORMATS = ("usd", "usdz")  # in metres where they say what their unit is, else as they are
_BY_SUFFIX: Mapping[str, str] = {"stp": "step", "usda": "usd", "usdc": "usd"}
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

    def at_most(self, distance: float) -> float:
        """What a proven upper end is in this unit: rounded up, but for 0, which needs no rounding.

        Args:
            distance: in the unit of the files, at least 0.
        """
        if self.length == 1 or distance == 0:
            return distance
        return math.nextafter(distance / self.length, math.inf)

    def at_least(self, distance: float) -> float:
        """What a proven lower end is in this unit: rounded down.

        Args:
            distance: in the unit of the files, at least 0.
        """
        return distance if self.length == 1 else math.nextafter(distance / self.length, 0.0)


def unit_for(named: str | None, *formats: str) -> Unit:
    """The unit that a bound in model units is in.

    Args:
        named: what a gate calls it, if it does.
        formats: of the files whose sizes count. Metres where one of them is a glTF, else
            millimetres where one is a STEP, and the name is then that of a length; else what the
            gate calls it, or "units".

    Raises:
        InputError: the name is that of no length, or of one that is not converted to.
    """
    for own, said, kinds in (
        ("m", "a glTF is in metres", GLTF_FORMATS),
        ("mm", "a STEP is read in millimetres", _STEP_FORMATS),
    ):
        if any(each in kinds for each in formats):
            return _converted(own if named is None else named, own, said)
    if named not in (None, "m") and any(each in _USD_FORMATS for each in formats):
        raise InputError(
            f"a USD is read in metres or as it is, and nothing in '{named}' is converted to "
            "that: write lengths in metres"
        )
    return Unit(named or "units")


def _converted(named: str, own: str, said: str) -> Unit:
    if named not in LENGTHS:
        raise InputError(
            f"{said}, and '{named}' is not a known unit{did_you_mean(named, LENGTHS)}: expected "
            f"one of {', '.join(LENGTHS)}"
        )
    return Unit(named, LENGTHS[named] / LENGTHS[own])


def formats_for(key: str, source: str, reference: str | None, *, scaled: bool) -> tuple[str, ...]:
    """Formats of the files whose sizes count for a value: of a size, the one that has it."""
    if not is_size(key):
        return sized(source, reference, scaled=scaled)
    if reference is not None and key.startswith("asset.reference."):
        return (reference,)
    return (source,)


def format_named(name: str) -> str:
    """The format that a file's name says it has; what an archive holds its name does not say."""
    suffix = PurePosixPath(name.lower()).suffix[1:]
    return _BY_SUFFIX.get(suffix, suffix)


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
