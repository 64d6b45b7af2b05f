"""How far a refined surface and its reference may go from each other."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from meshcone.errors import InputError
from meshcone.gates.units import GLTF_FORMATS, format_named, unit_for

TOLERANCE_LENGTH = 40  # characters
_TOLERANCE = re.compile(r"(?P<number>\d*\.?\d+(?:[eE][+-]?\d+)?) ?(?P<unit>%|[A-Za-z]{0,20})")


@dataclass(frozen=True)
class Tolerance:
    """How far the refined surface and the reference may go from each other.

    Attributes:
        value: in the unit of the files, or relative to the reference's radius.
        relative: which of both.
        unit: what the unit of the files is called, if it was named.
    """

    value: float
    relative: bool = False
    unit: str | None = None

    @staticmethod
    def parse(text: str) -> Tolerance:
        """Read ``0.5``, ``0.5mm`` (named as the files' unit) or ``0.2%`` (of the radius).

        Raises:
            InputError: it is none of these, or not positive.
        """
        found = _TOLERANCE.fullmatch(text.strip())
        value = float(found["number"]) if found else 0.0
        if found is None or not 1e-12 <= value <= 1e12:
            raise InputError(
                f"'{text}' is not a tolerance: expected a length in the unit of the files, such as "
                "0.5 or 0.5mm, or a share of the radius, such as 0.2%"
            )
        if found["unit"] == "%":
            return Tolerance(value / 100, relative=True)
        return Tolerance(value, unit=found["unit"] or None)

    def for_files(self, names: Iterable[str]) -> Tolerance:
        """The same in the unit of the files, which is the metre where one of them is a glTF.

        Raises:
            InputError: the unit is named, and is no length that is known.
        """
        formats = tuple(map(format_named, names))
        if any(each in GLTF_FORMATS for each in formats):
            return self.in_metres()
        unit_for(self.unit, *formats)
        return self

    def in_metres(self) -> Tolerance:
        """The same where the unit of the files is the metre.

        Raises:
            InputError: the unit is named, and is none of those known.
        """
        if self.relative or self.unit is None:
            return self
        return Tolerance(self.value * unit_for(self.unit, *GLTF_FORMATS).length, unit="m")
