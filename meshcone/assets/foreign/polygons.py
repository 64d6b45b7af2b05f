"""What the readers of PLY, STL and OFF have in common: polygons, and checks of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meshcone.assets.foreign.places import Places
from meshcone.assets.limits import LARGEST_COORDINATE
from meshcone.errors import InputError


@dataclass(frozen=True)
class Polygons:
    """Polygons as a file lists them.

    Attributes:
        positions: (r, 3) vertices; they need not be finite.
        corners: (c,) vertex of each corner, polygon after polygon.
        sizes: (p,) corners of each polygon.
        places: where the file has the vertices; None where nobody here can say.
    """

    positions: NDArray[np.float64]
    corners: NDArray[np.int64]
    sizes: NDArray[np.int64]
    places: Places | None = None


def check_positions(positions: NDArray[np.float64], place: Callable[[int], str]) -> None:
    """Compare (r, 3) coordinates, where they are finite, with ``LARGEST_COORDINATE``.

    Args:
        positions: the coordinates.
        place: where in the file a vertex stands, by its row.

    Raises:
        InputError: naming the first that is too large.
    """
    far = (np.isfinite(positions) & (np.abs(positions) > LARGEST_COORDINATE)).any(axis=1)
    if far.any():
        row = int(np.flatnonzero(far)[0])
        found = next(value for value in positions[row] if abs(value) > LARGEST_COORDINATE)
        raise InputError(
            f"expected a number of at most {LARGEST_COORDINATE:g}, found {found:g}",
            place=place(row),
        )


def check_corners(
    corners: NDArray[np.int64],
    sizes: NDArray[np.int64],
    vertices: int,
    place: Callable[[int], str],
    least: int = 0,
) -> None:
    """Compare (c,) corners of (p,) polygons with the number of vertices.

    Raises:
        InputError: naming the first that is not among them.
    """
    outside = (corners < least) | (corners >= vertices)
    if outside.any():
        corner = int(np.flatnonzero(outside)[0])
        polygon = int(np.searchsorted(np.cumsum(sizes), corner, side="right"))
        expected = f"0 to {vertices - 1}" if vertices else "none: there are no vertices"
        raise InputError(
            f"a face names vertex {corners[corner]}; expected {expected}", place=place(polygon)
        )
