"""What is wrong with a surface, and what it encloses."""

from __future__ import annotations

from pydantic import Field

from meshcone.auditing.records.section import Section


class Geometry(Section):
    """Counts on the welded surface; null where a count was not taken."""

    watertight: bool = Field(description="every edge has exactly two faces")
    boundary_edges: int = Field(description="edges with one face")
    non_manifold_edges: int = Field(description="edges with more than two faces")
    opposed_edges: int = Field(
        description="edges across which two faces turn their outsides in opposite directions"
    )
    degenerate_faces: int = Field(
        description="triangles drawn without area, instances counted each time, those with two "
        "equal corners among them"
    )
    duplicate_faces: int = Field(description="faces with the same three vertices as an earlier one")
    self_intersections: int | None = Field(
        description="pairs of faces that pass through each other; null: not tested, because the "
        "test would not have ended in bounded time"
    )
    slivers: int = Field(description="faces less than 1 % as high as their longest side is long")
    hard_edges: int = Field(description="edges between faces that meet at more than 30 degrees")
    sharp_edges: int = Field(description="edges between faces that meet at 89 degrees or more")
    t_junctions: int | None = Field(
        description="vertices of open borders that lie on an edge of one; null: not tested"
    )
    isolated_vertices: int = Field(
        description="vertices of the file, of what is drawn, that no triangle uses"
    )
    pieces: int = Field(description="parts connected by shared vertices")
    closed_pieces: int = Field(description="pieces without an open border")
    debris: int = Field(description="pieces smaller than 1 % of the whole")
    inside_out_share: float = Field(
        description="share of the surface in closed parts, connected by edges, that face inwards; "
        "cavities, which lie within what the other parts fill, do not"
    )
    area: float = Field(description="in model units squared")
    volume: float | None = Field(
        description="that the closed pieces enclose, whichever way they face, in model units "
        "cubed, cavities taken out; null where some piece is open"
    )
