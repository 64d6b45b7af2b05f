"""How a certificate stores the division of the source's faces, and whether it is one.

A face that is divided is stored as its children, each with whole numbers for its corners; all
others are their own only child. Nothing of that is believed before it is checked.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from meshcone.errors import InputError
from meshcone.surface.arrays import Ints
from meshcone.surface.subdivision import MAX_EXPONENT, Subdivision

_NAMES = ("shape", "parents", "corners")


@dataclass(frozen=True)
class DivisionRecord:
    """A division as stored: anybody's numbers, of the right types and shapes.

    Attributes:
        sources: faces of the source.
        exponent: the numbers of all corners are over 2 ** exponent.
        parents: (c,) face of the source that each child lies in, of those that are divided.
        corners: (c, 3, 2) child, its corner, and the numerators of its weights of the first and
            second corner of the parent; that of the third is what is left of 2 ** exponent.
    """

    sources: int
    exponent: int
    parents: Ints
    corners: Ints

    @staticmethod
    def of(subdivision: Subdivision) -> DivisionRecord:
        """Take what has to be stored of a subdivision."""
        children = subdivision.divided[subdivision.parents]
        return DivisionRecord(
            subdivision.sources,
            subdivision.exponent,
            subdivision.parents[children],
            subdivision.corners[children, :, :2].astype(np.int64),
        )

    def arrays(self) -> dict[str, Any]:
        """The arrays by name, in the smallest types that hold them."""
        return {
            "shape": np.array([self.sources, self.exponent], dtype=np.int64),
            "parents": _narrow(self.parents),
            "corners": _narrow(self.corners),
        }

    @staticmethod
    def of_arrays(arrays: dict[str, Any]) -> DivisionRecord:
        """Read what :meth:`arrays` gives.

        Raises:
            InputError: one is missing, or of another type or shape.
        """
        if arrays.keys() != set(_NAMES):
            raise InputError(f"a division has the arrays {', '.join(_NAMES)}, and no other")
        if any(array.dtype.kind not in "iu" for array in arrays.values()):
            raise InputError("a division holds whole numbers alone")
        shape, parents, corners = (arrays[name].astype(np.int64) for name in _NAMES)
        children = parents.shape[0] if parents.ndim == 1 else -1
        if shape.shape != (2,) or corners.shape != (children, 3, 2):
            raise InputError("the arrays of a division do not fit each other")
        return DivisionRecord(int(shape[0]), int(shape[1]), parents, corners)

    def checked(self, faces: Ints) -> Subdivision:
        """Show by whole numbers that this divides some faces.

        Args:
            faces: (m, 3) the source's.

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
        return subdivision

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
