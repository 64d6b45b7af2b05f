"""How a certificate stores the division of the source's faces, and whether it is one.

A face that is divided is stored as its children, each with whole numbers for its corners; all
others are their own only child. Where diagonals between children are swapped, the faces that
differ are stored too, by the children's corners that each has. Nothing of that is believed before
it is checked.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from meshcone.errors import InputError
from meshcone.surface.arrays import Ints
from meshcone.surface.charts import Charts
from meshcone.surface.subdivision import MAX_EXPONENT, Subdivision

_NAMES = ("shape", "parents", "corners")
_OF_SWAPS = ("swapped", "slots")  # absent where no diagonal is swapped


@dataclass(frozen=True)
class DivisionRecord:
    """A division as stored: anybody's numbers, of the right types and shapes.

    Attributes:
        sources: faces of the source.
        exponent: the numbers of all corners are over 2 ** exponent.
        parents: (c,) face of the source that each child lies in, of those that are divided.
        corners: (c, 3, 2) child, its corner, and the numerators of its weights of the first and
            second corner of the parent; that of the third is what is left of 2 ** exponent.
        swapped: (s,) faces that have other corners than the child in their row.
        slots: (s, 3) the corners that they have; see :class:`Subdivision`.
    """

    sources: int
    exponent: int
    parents: Ints
    corners: Ints
    swapped: Ints = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    slots: Ints = field(default_factory=lambda: np.empty((0, 3), dtype=np.int64))

    @staticmethod
    def of(subdivision: Subdivision) -> DivisionRecord:
        """Take what has to be stored of a subdivision."""
        children = subdivision.unswapped().divided[subdivision.parents]
        swapped = np.flatnonzero(subdivision.swapped).astype(np.int64)
        return DivisionRecord(
            subdivision.sources,
            subdivision.exponent,
            subdivision.parents[children],
            subdivision.corners[children, :, :2].astype(np.int64),
            swapped,
            subdivision.slots[swapped],
        )

    def arrays(self) -> dict[str, Any]:
        """The arrays by name, in the smallest types that hold them."""
        arrays = {
            "shape": np.array([self.sources, self.exponent], dtype=np.int64),
            "parents": _narrow(self.parents),
            "corners": _narrow(self.corners),
        }
        swaps = {"swapped": _narrow(self.swapped), "slots": _narrow(self.slots)}
        return arrays | swaps if len(self.swapped) else arrays

    @staticmethod
    def of_arrays(arrays: dict[str, Any]) -> DivisionRecord:
        """Read what :meth:`arrays` gives.

        Raises:
            InputError: one is missing, or of another type or shape.
        """
        arrays = dict(arrays)
        if not arrays.keys() & set(_OF_SWAPS):
            arrays |= {"swapped": np.empty(0, dtype=int), "slots": np.empty((0, 3), dtype=int)}
        if arrays.keys() != {*_NAMES, *_OF_SWAPS}:
            raise InputError(
                f"a division has the arrays {', '.join(_NAMES)}, where diagonals are swapped "
                f"{' and '.join(_OF_SWAPS)} too, and no other"
            )
        if any(array.dtype.kind not in "iu" for array in arrays.values()):
            raise InputError("a division holds whole numbers alone")
        shape, parents, corners, swapped, slots = (
            arrays[name].astype(np.int64) for name in (*_NAMES, *_OF_SWAPS)
        )
        children, rows = (each.shape[0] if each.ndim == 1 else -1 for each in (parents, swapped))
        fits = corners.shape == (children, 3, 2) and slots.shape == (rows, 3)
        if shape.shape != (2,) or not fits:
            raise InputError("the arrays of a division do not fit each other")
        return DivisionRecord(int(shape[0]), int(shape[1]), parents, corners, swapped, slots)

    def checked(self, faces: Ints, charts: Callable[[], Charts]) -> Subdivision:
        """Show that this divides some faces, by whole numbers up to where diagonals are swapped.

        Args:
            faces: (m, 3) the source's.
            charts: gives those of these faces; asked for only where diagonals are swapped.

        Raises:
            InputError: it does not; the message says in what.
        """
        if self.sources != len(faces):
            raise InputError(
                f"the division is of {self.sources:,} faces, the source has {len(faces):,}"
            )
        if not 0 <= self.exponent <= MAX_EXPONENT:
            raise InputError(
                f"the division counts in parts of 2^{self.exponent}, from 2^0 to "
                f"2^{MAX_EXPONENT} are possible"
            )
        if len(self.parents) and not (self.parents.min() >= 0 and self.parents.max() < len(faces)):
            raise InputError("the division has a child of a face that the source does not have")
        third = 2**self.exponent - self.corners.sum(axis=2, keepdims=True)
        corners = np.concatenate([self.corners, third], axis=2)
        outside = np.flatnonzero(
            (corners < 0).any(axis=(1, 2)) | (corners > 2**self.exponent).any(axis=(1, 2))
        )
        if len(outside):
            raise InputError(f"a child lies outside of {_face(self.parents[outside[0]])}")
        subdivision = self._of_all(len(faces), corners)
        if not subdivision.is_tiling():
            raise InputError(_untiled(subdivision))
        if not subdivision.is_conforming(faces):
            raise InputError(
                "two faces that share a side divide it at different points: the surface opens there"
            )
        return self._with_swaps(subdivision, charts) if len(self.swapped) else subdivision

    def _with_swaps(self, subdivision: Subdivision, charts: Callable[[], Charts]) -> Subdivision:
        count = len(subdivision.parents)
        for array, most in ((self.swapped, count), (self.slots, 3 * count)):
            if array.min() < 0 or array.max() >= most:
                raise InputError("a diagonal is swapped between faces that there are none of")
        slots = subdivision.slots.copy()
        slots[self.swapped] = self.slots
        wrong = charts().over(subdivision).retiled(slots)
        if wrong is not None:
            raise InputError(f"diagonals are swapped so that {wrong}")
        return replace(subdivision, slots=slots)

    def _of_all(self, count: int, corners: Ints) -> Subdivision:
        whole = np.flatnonzero(np.bincount(self.parents, minlength=count) == 0)
        own = np.tile(np.eye(3, dtype=np.int64) << self.exponent, (len(whole), 1, 1))
        parents = np.concatenate([self.parents, whole])
        order = np.argsort(parents, kind="stable")
        both = np.concatenate([corners, own]).astype(np.int32)
        return Subdivision(count, parents[order], both[order], self.exponent)


def _untiled(subdivision: Subdivision) -> str:
    """Why children do not tile their parents, with the first face of which it can be told."""
    one, other = (
        subdivision.corners[:, k, :2].astype(np.int64) - subdivision.corners[:, 0, :2]
        for k in (1, 2)
    )
    areas = one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
    turned = np.flatnonzero(areas <= 0)
    if len(turned):
        return f"a child is turned over or without area in {_face(subdivision.parents[turned[0]])}"
    sums = np.bincount(subdivision.parents, areas, subdivision.sources)
    wrong = np.flatnonzero(sums != 4.0**subdivision.exponent)
    if len(wrong):
        more = "more" if sums[wrong[0]] > 4.0**subdivision.exponent else "less"
        return f"the children of {_face(wrong[0])} cover {more} than it"
    return "children of a face overlap, or a corner of one lies within the side of another"


def _face(index: np.int64) -> str:
    return f"face {int(index)} of the source"


def _narrow(values: Ints) -> Any:
    """Whole numbers from 0 in the smallest type that holds them all."""
    return values.astype(np.min_scalar_type(int(values.max(initial=0))))
