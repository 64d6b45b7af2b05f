"""How much a file holds."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class AssetCounts:
    """Sizes of a file, for the report.

    Attributes:
        vertices: raw vertices, split by seams, as the file stores them.
        welded_vertices: distinct positions some face uses.
        faces: triangles, as the file lists them, those without area among them.
        polygons: faces as the file lists them; equal to the triangles it lists in glTF.
        meshes: OBJ objects, or glTF meshes placed by a node.
        materials: materials the faces name.
    """

    vertices: int
    welded_vertices: int
    faces: int
    polygons: int
    meshes: int
    materials: int
