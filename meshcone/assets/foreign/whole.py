"""Numbers of types that hold whole ones alone, and directions in them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshcone.errors import InputError

# The type of each column where it holds whole numbers alone; None where it holds others too.
Whole = tuple[np.dtype[Any] | None, ...]


def whole_columns(kinds: Sequence[np.dtype[Any]], stored: NDArray[np.float64]) -> Whole:
    """Which columns of a file have whole numbers alone.

    A text may declare a type that its words are not of; then they are what counts.

    Args:
        kinds: the type that the file declares for each of c columns.
        stored: (n, c) numbers there; what is not finite counts for nothing.
    """
    return tuple(
        kind if kind.kind != "f" and _holds(kind, column) else None
        for kind, column in zip(kinds, stored.T, strict=True)
    )


def rounded(
    values: NDArray[np.float64], kind: np.dtype[Any]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """The nearest whole numbers, and which of them a type holds."""
    nearest = np.rint(values)
    bounds = np.iinfo(kind)
    return nearest, (nearest >= bounds.min) & (nearest <= bounds.max)


def misfit(kind: np.dtype[Any], place: str) -> InputError:
    """A number that its type does not hold."""
    return InputError(
        f"a refined value does not fit {kind.name}; store floats instead", place=place
    )


def has_no_sign(columns: Whole) -> bool:
    """Whether a column cannot hold what is below zero, so that directions are coded in it."""
    return any(kind is not None and kind.kind == "u" for kind in columns)


def lengthened(
    normals: NDArray[np.float64], stored: NDArray[np.float64], columns: Whole
) -> NDArray[np.float64]:
    """Directions as long as the file has them: whole numbers of a unit vector tell none.

    Args:
        normals: (n, 3) unit vectors.
        stored: (n, 3) what the file has; where that has no length, the longest counts.
        columns: the types. Where none is of whole numbers, the vectors stay as they are.
    """
    bounds = [np.iinfo(kind).max for kind in columns if kind is not None]
    if not bounds:
        return normals
    lengths = np.nan_to_num(np.linalg.norm(stored, axis=1))
    longest = float(lengths.max(initial=0.0)) or float(min(bounds))
    lengths = np.minimum(np.where(lengths > 0, lengths, longest), min(bounds))
    own = np.linalg.norm(normals, axis=1)
    scale = np.divide(lengths, own, out=np.zeros_like(own), where=own > 0)
    return np.asarray(normals * scale[:, None], dtype=np.float64)


def _holds(kind: np.dtype[Any], column: NDArray[np.float64]) -> bool:
    known = column[np.isfinite(column)]
    nearest, fits = rounded(known, kind)
    return bool(fits.all() and (nearest == known).all())
