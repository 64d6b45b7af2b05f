"""How large an asset is, and where it stands."""

from __future__ import annotations

from typing import Self

import numpy as np
from pydantic import Field

from meshcone.audit.records import Section
from meshcone.audit.subject import Subject

_CLOSE = 0.01  # of the box's size: what counts as centred, or as standing on the floor


class Size(Section):
    """The box around the surface, in model units, y pointing upwards."""

    width: float = Field(description="along x, in model units")
    height: float = Field(description="along y, in model units")
    depth: float = Field(description="along z, in model units")
    diagonal: float = Field(description="of the box, in model units")
    low: tuple[float, float, float] = Field(description="least coordinates, in model units")
    high: tuple[float, float, float] = Field(description="greatest coordinates, in model units")
    origin_centred: bool = Field(
        description="whether the origin is within 1 % of the middle of width and depth"
    )
    origin_on_floor: bool = Field(
        description="whether the origin is within 1 % of the height of the box's bottom"
    )
    clean_root: bool = Field(description="whether no root node moves, turns or scales anything")

    @classmethod
    def of(cls, subject: Subject) -> Self:
        """Measure the box, and where the origin lies in it."""
        low, high = subject.box
        extent = high - low
        middle = np.abs(low + high) / 2
        near = _CLOSE * np.maximum(extent, _CLOSE * subject.diagonal)
        roots = [node for node in subject.content.nodes if node.depth == 1]
        return cls(
            width=float(extent[0]),
            height=float(extent[1]),
            depth=float(extent[2]),
            diagonal=subject.diagonal,
            low=(float(low[0]), float(low[1]), float(low[2])),
            high=(float(high[0]), float(high[1]), float(high[2])),
            origin_centred=bool(middle[0] <= near[0] and middle[2] <= near[2]),
            origin_on_floor=bool(abs(low[1]) <= near[1]),
            clean_root=all(np.array_equal(root.matrix, np.eye(4)) for root in roots),
        )
