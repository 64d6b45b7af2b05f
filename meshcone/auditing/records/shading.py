"""What is wrong with stored normals and tangents."""

from __future__ import annotations

from pydantic import Field

from meshcone.auditing.records.section import Section


class Shading(Section):
    """Counts over the corners of all triangles that have an area."""

    corners: int = Field(description="corners of the triangles that are drawn")
    without_normals: int = Field(description="corners that have no normal")
    zero_normals: int = Field(description="corners whose normal is zero or no number")
    not_unit_normals: int = Field(description="corners whose normal is longer or shorter than 1")
    opposed_normals: int = Field(description="corners whose normal points to the triangle's back")
    opposed_normals_share: float = Field(description="share of the corners that have a normal")
    without_tangents: int = Field(
        description="corners without a tangent whose material has a normal map; viewers make "
        "their own"
    )
    zero_tangents: int = Field(description="corners whose tangent is zero or no number")
    not_unit_tangents: int = Field(description="corners whose tangent is longer or shorter than 1")
    wrong_handedness: int = Field(description="corners whose tangent's w is neither 1 nor -1")
