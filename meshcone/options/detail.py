"""Whether faces are added where the source has too few of them."""

from __future__ import annotations

import re
from typing import Any, Literal

from pydantic import Field

from meshcone.errors import InputError
from meshcone.options.section import Section

_ASKED = re.compile(r"(?P<times>\d{1,4}(?:\.\d{1,6})?)x|(?P<faces>\d{1,9})")
_AUTO_GROWTH = 16.0  # what is not within a tolerance at so many times the faces, detail is not for


class DetailOptions(Section):
    """Faces divided where they miss the reference; nothing is, unless a limit is given."""

    growth: float = Field(
        1.0,
        ge=1.0,
        le=64.0,
        allow_inf_nan=False,
        description="times as many faces as the source has, at most; 1: as many as it has",
    )
    max_faces: int | None = Field(
        None,
        ge=1,
        le=100_000_000,
        description="faces at most, instead of `growth`",
    )
    tolerance: float = Field(
        0.0,
        ge=0.0,
        le=1.0,
        allow_inf_nan=False,
        description="distance from the reference, relative to its radius, within which nothing "
        "is divided any more; 0: the limit on faces alone ends it",
    )

    flips: Literal["none", "parent", "chart"] = Field(
        "parent",
        description="where diagonals are swapped that lie badly: `parent`, inside each face of "
        "the source, so that its parts tile it; `chart`, on its sides too, where texture "
        "coordinates and all else go on across them, which changes the inside of the texture's "
        "map and not its outline; `none`, nowhere",
    )

    @staticmethod
    def asked(text: str) -> dict[str, Any]:
        """Read how much detail is asked for.

        Args:
            text: ``4x`` for four times the faces, ``20000`` for so many, or ``auto`` for what a
                tolerance takes, up to sixteen times the faces.

        Returns:
            The options that mean it.

        Raises:
            InputError: it is none of these.
        """
        found = _ASKED.fullmatch(text.strip())
        if text.strip() == "auto":
            return {"growth": _AUTO_GROWTH}
        if found is None:
            raise InputError(
                f"'{text[:40]}' is not an amount of detail: expected 4x for four times the faces, "
                "20000 for so many faces, or auto for what a tolerance takes"
            )
        if found["faces"] is not None:
            return {"max_faces": int(found["faces"])}
        return {"growth": float(found["times"])}

    @property
    def wanted(self) -> bool:
        """Whether faces may be added at all."""
        return self.growth > 1 or self.max_faces is not None

    def faces_allowed(self, faces: int) -> int:
        """How many faces a source of so many may have afterwards."""
        limit = int(self.growth * faces) if self.max_faces is None else self.max_faces
        return max(faces, limit)
