"""Distances to triangles that need no search to be believed."""

from __future__ import annotations

import numpy as np

from meshcone.surface import Mesh
from meshcone.surface.arrays import Bools, Floats, Ints, row_dot
from meshcone.surface.compiled import compiled

_TINY = 1e-300

_Vector = tuple[float, float, float]


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
        _measure(np.ascontiguousarray(points), self.rows, np.require(faces, np.int64, ["C"]), found)
        return found

    def distance_at_least(self, point: Floats) -> float:
        """Prove a lower bound on the distance from one point (3,) to all of the faces.

        A face lies behind the plane that stands, at its closest point found, on the line to
        the point; the bound is the smallest height of the point over such planes, as they
        are pushed back to touch their face's farthest corner. So it holds even where a
        closest point was found wrong.
        """
        return max(float(_lowest(np.ascontiguousarray(point), self.rows)), 0.0)


def corners_among(corners: Floats, others: Floats) -> Bools:
    """Whether each (k, 3, 3) triangle has no corner that the other one has not, (k,)."""
    equal = (corners[:, :, None] == others[:, None]).all(axis=3)
    return np.asarray(equal.any(axis=2).all(axis=1))


# What is called stands above what calls it, which is compiled when it is read.


@compiled()
def _clipped(share: float) -> float:
    """A share of an edge between 0 and 1; 0 for an edge without length."""
    return 1.0 if share >= 1 else share if share > 0 else 0.0


@compiled()
def _less(vector: _Vector, row: Floats, v: float, w: float) -> _Vector:
    """A vector from a face's first corner, less v (b − a) + w (c − a)."""
    x, y, z = vector[0] - v * row[3], vector[1] - v * row[4], vector[2] - v * row[5]
    return x - w * row[6], y - w * row[7], z - w * row[8]


@compiled()
def _product(left: _Vector, x: float, y: float, z: float) -> float:
    return left[0] * x + left[1] * y + left[2] * z


@compiled()
def _shortest(x: float, y: float, z: float, row: Floats) -> _Vector:
    """The shortest vector to a point from four feet a + v (b − a) + w (c − a).

    One foot is inside the face, or at its first corner, and one on each edge; v, w ≥ 0 and
    v + w ≤ 1 hold by construction. The shortest vector leads to the closest point. That
    vectors are compared, and nothing derived from them, keeps small distances accurate.
    """
    offset = x - row[0], y - row[1], z - row[2]
    aa, bb, cc, area = row[12], row[13], row[14], row[15]
    along_ab = _product(offset, row[3], row[4], row[5])
    along_ac = _product(offset, row[6], row[7], row[8])
    # Of a face without area these are no numbers, and no comparison with them is true.
    w = _product(offset, row[9], row[10], row[11]) / area
    v = (along_ab - w * bb) / aa
    inside = v >= 0 and w >= 0 and v + w <= 1
    on_bc = _clipped((along_ac - along_ab - bb + aa) / (aa - 2 * bb + cc))
    best = _less(offset, row, v if inside else 0.0, w if inside else 0.0)
    least = _product(best, best[0], best[1], best[2])
    for edge in range(3):
        if edge == 0:
            other = _less(offset, row, _clipped(along_ab / aa), 0.0)
        elif edge == 1:
            other = _less(offset, row, 0.0, _clipped(along_ac / cc))
        else:
            other = _less(offset, row, 1 - on_bc, on_bc)
        squared = _product(other, other[0], other[1], other[2])
        if squared < least:
            best, least = other, squared
    return best


@compiled("void(float64[:,::1], float64[:,::1], int64[::1], float64[::1])")
def _measure(points: Floats, rows: Floats, faces: Ints, found: Floats) -> None:
    for i in range(len(points)):
        best = _shortest(points[i, 0], points[i, 1], points[i, 2], rows[faces[i]])
        found[i] = np.sqrt(_product(best, best[0], best[1], best[2]))


@compiled("float64(float64[::1], float64[:,::1])")
def _lowest(point: Floats, rows: Floats) -> float:
    """The smallest height of a point (3,) over the planes of all faces, as above."""
    lowest = np.inf
    for face in range(len(rows)):
        row = rows[face]
        x, y, z = _shortest(point[0], point[1], point[2], row)
        length = max(np.sqrt(x * x + y * y + z * z), _TINY)
        normal = x / length, y / length, z / length
        a, b, c = point[0] - row[0], point[1] - row[1], point[2] - row[2]
        for v, w in ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0)):
            corner = _less((a, b, c), row, v, w)
            lowest = min(lowest, _product(normal, corner[0], corner[1], corner[2]))
    return lowest
