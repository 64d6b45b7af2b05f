"""Points on the faces of a mesh, and their shares of the corners, in one pass over memory each."""

from __future__ import annotations

from meshcone.surface.arrays import Floats, Ints
from meshcone.surface.compiled import compiled

_ROWS, _PLACES = "float64[:,::1]", "int64[::1]"
# Of a mesh, whose arrays a caller may have made so that nobody can write to them.
_MESH = "Array(float64, 2, 'C', True), Array(int64, 2, 'C', True)"
_FLAT = 1e-14  # squared sine of the angle between two sides


@compiled()
def _clipped(share: float) -> float:
    return min(max(share, 0.0), 1.0)


@compiled(f"void({_ROWS}, {_MESH}, {_PLACES}, {_ROWS})")
def find_shares(points: Floats, vertices: Floats, faces: Ints, on: Ints, shares: Floats) -> None:
    """Write the shares (k, 3) of the corners in k points of faces.

    They are clipped to the face and sum to one; those of a face without area are equal.
    """
    for i in range(len(points)):
        a, b, c = faces[on[i], 0], faces[on[i], 1], faces[on[i], 2]
        d00 = d01 = d11 = d20 = d21 = 0.0
        for k in (0, 2, 1):  # numpy's order where it adds three products: the same bits
            first, second = vertices[b, k] - vertices[a, k], vertices[c, k] - vertices[a, k]
            offset = points[i, k] - vertices[a, k]
            d00 += first * first
            d01 += first * second
            d11 += second * second
            d20 += offset * first
            d21 += offset * second
        determinant = d00 * d11 - d01 * d01
        v = w = 1 / 3
        if not determinant <= _FLAT * d00 * d11:
            v = (d11 * d20 - d01 * d21) / determinant
            w = (d00 * d21 - d01 * d20) / determinant
        u, v, w = _clipped(1 - v - w), _clipped(v), _clipped(w)
        total = u + v + w
        shares[i, 0], shares[i, 1], shares[i, 2] = u / total, v / total, w / total


@compiled(f"void({_ROWS}, {_MESH}, {_PLACES}, {_ROWS})")
def place(shares: Floats, vertices: Floats, faces: Ints, on: Ints, points: Floats) -> None:
    """Write where k points of faces are, (k, 3), by their shares of the corners."""
    for i in range(len(shares)):
        a, b, c = faces[on[i], 0], faces[on[i], 1], faces[on[i], 2]
        u, v, w = shares[i, 0], shares[i, 1], shares[i, 2]
        for k in range(3):
            points[i, k] = u * vertices[a, k] + v * vertices[b, k] + w * vertices[c, k]
