"""Distances to triangles that need no search to be believed."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import reduce

import numpy as np

from meshcone.surface import Mesh
from meshcone.surface.arrays import Bools, Floats, Ints, row_dot, row_lengths

# Rows worked on at a time: temporaries stay in the processor's cache.
_BLOCK = 8192
_TINY = 1e-300


class Triangles:
    """The faces of a mesh, prepared for distances from points to faces that are named.

    Attributes:
        rows: (m, 16) for each face a, b − a, c − a, the part of c − a across b − a, and the
            products of these; one row is one place in memory.
    """

    def __init__(self, mesh: Mesh) -> None:
        """Prepare the faces of a mesh; O(m)."""
        a, b, c = (mesh.vertices.take(corner, axis=0) for corner in mesh.faces.T)
        ab, ac = b - a, c - a
        length = row_dot(ab, ab)
        across = ac
        for _ in range(2):  # a second time, because one leaves slivers with nothing but rounding
            share = np.divide(row_dot(across, ab), length, out=np.zeros(len(a)), where=length > 0)
            across = across - share[:, None] * ab
        products = (length, row_dot(ab, ac), row_dot(ac, ac), row_dot(across, across))
        self.rows: Floats = np.ascontiguousarray(np.column_stack([a, ab, ac, across, *products]))

    def __len__(self) -> int:
        return len(self.rows)

    def distances(self, points: Floats, faces: Ints) -> Floats:
        """Distances from (k, 3) points to a point of each one's face, (k,).

        That point is the closest one of the face up to rounding. It lies in the face
        whether or not it is: a distance is never below the true one by more than rounding.
        """
        found = np.empty(len(points))
        for start in range(0, len(points), _BLOCK):
            block = slice(start, start + _BLOCK)
            vectors = _vectors(points[block], self.rows.take(faces[block], axis=0))
            found[block] = np.sqrt(reduce(np.minimum, (_products(each, each) for each in vectors)))
        return found

    def distance_at_least(self, point: Floats) -> float:
        """Prove a lower bound on the distance from one point (3,) to all of the faces.

        A face lies behind the plane that stands, at its closest point found, on the line to
        the point; the bound is the smallest height of the point over such planes, as they
        are pushed back to touch their face's farthest corner. So it holds even where a
        closest point was found wrong.
        """
        lowest = np.inf
        for start in range(0, len(self), _BLOCK):
            rows = self.rows[start : start + _BLOCK]
            normals = _shortest(_vectors(np.broadcast_to(point, (len(rows), 3)), rows))
            normals /= np.maximum(row_lengths(normals), _TINY)[:, None]
            offset = point - rows[:, 0:3]
            heights = [
                row_dot(normals, offset),
                row_dot(normals, offset - rows[:, 3:6]),
                row_dot(normals, offset - rows[:, 6:9]),
            ]
            lowest = min(lowest, float(np.min(heights)))
        return max(lowest, 0.0)


def corners_among(corners: Floats, others: Floats) -> Bools:
    """Whether each (k, 3, 3) triangle has no corner that the other one has not, (k,)."""
    equal = (corners[:, :, None] == others[:, None]).all(axis=3)
    return np.asarray(equal.any(axis=2).all(axis=1))


_Vectors = tuple[Floats, Floats, Floats]


def _shortest(vectors: Iterable[_Vectors]) -> Floats:
    """The shortest of several vectors in each row, (k, 3)."""
    each = np.stack([np.stack(found, axis=1) for found in vectors])
    first = np.einsum("fij,fij->fi", each, each).argmin(axis=0)
    return np.asarray(each[first, np.arange(each.shape[1])])


def _vectors(points: Floats, rows: Floats) -> Iterator[_Vectors]:
    """Vectors to (k, 3) points from four feet a + v (b − a) + w (c − a), by coordinate.

    One foot is inside the face, or at its first corner, and one on each edge; v, w ≥ 0 and
    v + w ≤ 1 hold by construction. The shortest vector leads to the closest point. That
    vectors are compared, and nothing derived from them, keeps small distances accurate.
    """
    offset, ab, ac, across = (
        _columns(columns)
        for columns in (points - rows[:, :3], rows[:, 3:], rows[:, 6:], rows[:, 9:])
    )
    aa, bb, cc, area = rows[:, 12], rows[:, 13], rows[:, 14], rows[:, 15]
    along_ab, along_ac = _products(offset, ab), _products(offset, ac)
    with np.errstate(all="ignore"):  # faces without area: every comparison with NaN is false
        w = _products(offset, across) / area
        v = (along_ab - w * bb) / aa
        inside = (v >= 0) & (w >= 0) & (v + w <= 1)
        on_ab, on_ac = _clipped(along_ab / aa), _clipped(along_ac / cc)
        on_bc = _clipped((along_ac - along_ab - bb + aa) / (aa - 2 * bb + cc))
    yield _less(_less(offset, np.where(inside, v, 0.0), ab), np.where(inside, w, 0.0), ac)
    yield _less(offset, on_ab, ab)
    yield _less(offset, on_ac, ac)
    yield _less(_less(offset, 1 - on_bc, ab), on_bc, ac)


def _columns(rows: Floats) -> _Vectors:
    return rows[:, 0], rows[:, 1], rows[:, 2]


def _clipped(shares: Floats) -> Floats:
    """Shares of an edge between 0 and 1; 0 for an edge without length."""
    return np.minimum(np.where(shares > 0, shares, 0.0), 1.0)  # false for NaN


def _less(vectors: _Vectors, shares: Floats, sides: _Vectors) -> _Vectors:
    (x, y, z), (a, b, c) = vectors, sides
    return x - shares * a, y - shares * b, z - shares * c


def _products(left: _Vectors, right: _Vectors) -> Floats:
    return np.asarray(left[0] * right[0] + left[1] * right[1] + left[2] * right[2])
