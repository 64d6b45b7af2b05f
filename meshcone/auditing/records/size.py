"""How large an asset is, and where it stands."""

from __future__ import annotations

from pydantic import Field

from meshcone.auditing.records.section import Section


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
