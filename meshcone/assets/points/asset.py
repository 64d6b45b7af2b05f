"""Points without faces as an asset, to compare with.

Everything that looks for a closest point looks for it on triangles. So each point is one, a
millionth of the whole in size, at right angles to its normal: the closest point of such a set is
the closest of the points, to a millionth.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.astray import astray
from meshcone.assets.base import Asset
from meshcone.assets.counts import AssetCounts
from meshcone.assets.points.normals import estimated_normals, spacing_of
from meshcone.assets.policy import WritePolicy
from meshcone.assets.regions import Regions
from meshcone.assets.weld import weld_surface
from meshcone.errors import InputError
from meshcone.notices import Code, Notice

_SIZE = 1e-6  # of a point's triangle, as a share of the diagonal of all
_FEWEST = 4


class PointAsset(Asset):
    """A cloud of points.

    Attributes:
        spacing: median distance of a point from the nearest other.
    """

    is_points = True

    def __init__(
        self,
        name: str,
        kind: str,
        points: NDArray[np.float64],
        normals: NDArray[np.float64] | None,
    ) -> None:
        """Make a triangle of each point.

        Args:
            name: of the file.
            kind: its format.
            points: (n, 3) as the file lists them; of equal ones the first counts, and none that
                is not finite: scanners write these where they have seen nothing.
            normals: (n, 3), or None where they are to be estimated.

        Raises:
            InputError: there are too few points to be a surface.
        """
        listed = len(points)
        there = np.isfinite(points).all(axis=1)
        points = points[there]
        normals = None if normals is None else normals[there]
        distinct, first = np.unique(points + 0.0, axis=0, return_index=True)
        first = np.sort(first)
        if len(distinct) < _FEWEST:
            raise InputError(
                f"the file holds no surface: it has no faces, and {len(distinct)} distinct points"
            )
        distinct = points[first]
        given = normals is not None and bool(_are_directions(normals[first]))
        own = estimated_normals(distinct) if normals is None or not given else normals[first]
        size = _SIZE * float(np.linalg.norm(np.ptp(distinct, axis=0)))
        corners = _triangles(distinct, own, size)
        super().__init__(
            name,
            weld_surface(corners.reshape(-1, 3), np.arange(3 * len(distinct)).reshape(-1, 3)),
            regions=Regions.whole(len(distinct)),
            polygons=0,
            meshes=1,
            materials=0,
        )
        self.format, self.media_type = kind, f"model/{kind}"
        self.tolerance, self.spacing = size, spacing_of(distinct)
        self._counts = AssetCounts(
            vertices=listed,
            welded_vertices=len(distinct),
            faces=0,
            polygons=0,
            meshes=1,
            materials=0,
        )
        words = (
            f"{len(distinct):,} points without faces, {self.spacing:.3g} apart: distances are to "
            "the nearest of them, and of what lies between them nothing is proven"
        )
        words += "" if given else "; their normals are estimated from their neighbours"
        lost = astray(listed - len(points), 0, "faces")
        self.warnings = (Notice(Code.SURFACE_POINTS, words), *lost)

    def ensure_writable(self, policy: WritePolicy | None = None) -> None:  # noqa: ARG002
        """Refuse: there is nothing to refine.

        Raises:
            InputError: always.
        """
        raise points_alone(self.name)

    def _write(self, vertices: NDArray[np.float64], policy: WritePolicy) -> bytes:  # noqa: ARG002
        raise points_alone(self.name)


def points_alone(name: str) -> InputError:
    """The refusal of points as a source."""
    return InputError("this file has points and no faces: it can be a reference alone", file=name)


def _are_directions(normals: NDArray[np.float64]) -> bool:
    return bool(np.isfinite(normals).all()) and bool((normals != 0).any(axis=1).all())


def _triangles(
    points: NDArray[np.float64], normals: NDArray[np.float64], size: float
) -> NDArray[np.float64]:
    """(n, 3, 3) corners of a triangle around each point, ``size`` away from it."""
    unit = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    least = np.eye(3)[np.argmin(np.abs(unit), axis=1)]
    across = np.cross(unit, least)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    along = np.cross(unit, across)
    angles = 2 * np.pi * np.arange(3) / 3
    around = np.cos(angles)[:, None] * across[:, None] + np.sin(angles)[:, None] * along[:, None]
    return np.asarray(points[:, None] + size * around)
