"""Centre, size and principal axes of a surface, exactly, by its area."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from meshcone.surface.arrays import Floats
from meshcone.surface.mesh import Mesh


@dataclass(frozen=True)
class Moments:
    """Of a surface's area: centre (3,), principal second moments (3,) ascending, axes (3, 3)."""

    centre: Floats
    principal: Floats
    axes: Floats

    @staticmethod
    def of(mesh: Mesh) -> Moments:
        """Those of a mesh of positive area."""
        areas = mesh.face_areas / mesh.face_areas.sum()
        corners = mesh.corners
        middles = corners.mean(axis=1)
        centre = areas @ middles
        # ∫ x xᵀ over a triangle is area/12 (Σ pᵢ pᵢᵀ + 9 m mᵀ), with corners pᵢ and mean m.
        corners, middles = corners - centre, middles - centre
        second = np.einsum("f,fij,fik->jk", areas, corners, corners)
        second += 9 * (middles * areas[:, None]).T @ middles
        principal, axes = np.linalg.eigh(second / 12)
        return Moments(centre, np.maximum(principal, 0), axes)
