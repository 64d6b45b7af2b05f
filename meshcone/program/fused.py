"""The surface objective's products and diagonal blocks, each term in one pass over memory.

A pull is w (n nᵀ + τ I) on a point; fairness is Lᵀ W L, L with one row for each vertex; a point
that a mesh carries is the weighted sum of a face's corners. Of a symmetric block the entries
xx, yy, zz, xy, xz and yz are kept.
"""

from __future__ import annotations

from meshcone.surface.arrays import Floats, Ints, Ints32
from meshcone.surface.compiled import compiled

_ROWS, _NUMBERS = "float64[:,::1]", "float64[::1]"
_SPARSE = "int32[::1], int32[::1], float64[::1]"


@compiled(f"void({_ROWS}, {_NUMBERS}, {_ROWS}, float64, {_ROWS})")
def add_pulled(points: Floats, weights: Floats, normals: Floats, tau: float, out: Floats) -> None:
    """Add w (n nᵀ + τ I) x, for k points."""
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        nx, ny, nz = normals[i, 0], normals[i, 1], normals[i, 2]
        along, across = weights[i] * (nx * x + ny * y + nz * z), weights[i] * tau
        out[i, 0] += across * x + along * nx
        out[i, 1] += across * y + along * ny
        out[i, 2] += across * z + along * nz


@compiled(f"void({_ROWS}, int64[:,::1], {_ROWS}, {_NUMBERS}, {_ROWS}, float64, {_ROWS})")
def add_carried(
    positions: Floats,
    corners: Ints,
    shares: Floats,
    weights: Floats,
    normals: Floats,
    tau: float,
    out: Floats,
) -> None:
    """Add Bᵀ w (n nᵀ + τ I) B x, for n positions that carry k points."""
    for k in range(len(corners)):
        a, b, c = corners[k, 0], corners[k, 1], corners[k, 2]
        u, v, w = shares[k, 0], shares[k, 1], shares[k, 2]
        x = u * positions[a, 0] + v * positions[b, 0] + w * positions[c, 0]
        y = u * positions[a, 1] + v * positions[b, 1] + w * positions[c, 1]
        z = u * positions[a, 2] + v * positions[b, 2] + w * positions[c, 2]
        nx, ny, nz = normals[k, 0], normals[k, 1], normals[k, 2]
        along, across = weights[k] * (nx * x + ny * y + nz * z), weights[k] * tau
        x, y, z = across * x + along * nx, across * y + along * ny, across * z + along * nz
        for vertex, share in ((a, u), (b, v), (c, w)):
            out[vertex, 0] += share * x
            out[vertex, 1] += share * y
            out[vertex, 2] += share * z


@compiled(f"void({_ROWS}, {_SPARSE}, {_NUMBERS}, {_NUMBERS}, {_ROWS}, {_ROWS})")
def add_smoothed(
    positions: Floats,
    starts: Ints32,
    columns: Ints32,
    entries: Floats,
    weights: Floats,
    outline: Floats,
    normals: Floats,
    out: Floats,
) -> None:
    """Add Lᵀ W L x, W_i = b_i I + o_i (I − n_i n_iᵀ), for n positions; L as rows of entries."""
    for i in range(len(weights)):
        x = y = z = 0.0
        for k in range(starts[i], starts[i + 1]):
            j, entry = columns[k], entries[k]
            x += entry * positions[j, 0]
            y += entry * positions[j, 1]
            z += entry * positions[j, 2]
        nx, ny, nz = normals[i, 0], normals[i, 1], normals[i, 2]
        along, both = outline[i] * (nx * x + ny * y + nz * z), weights[i] + outline[i]
        x, y, z = both * x - along * nx, both * y - along * ny, both * z - along * nz
        for k in range(starts[i], starts[i + 1]):
            j, entry = columns[k], entries[k]
            out[j, 0] += entry * x
            out[j, 1] += entry * y
            out[j, 2] += entry * z


@compiled(f"void(int64[:,::1], {_ROWS}, {_ROWS}, {_ROWS})")
def add_to_corners(corners: Ints, shares: Floats, forces: Floats, out: Floats) -> None:
    """Add Bᵀ f to n vectors, for k forces on points that the corners carry."""
    for k in range(len(corners)):
        for corner in range(3):
            vertex, share = corners[k, corner], shares[k, corner]
            for axis in range(3):
                out[vertex, axis] += share * forces[k, axis]


@compiled()
def _add_block(
    out: Floats, row: int, along: float, nx: float, ny: float, nz: float, across: float
) -> None:
    """Add a n nᵀ + b I to one block."""
    out[row, 0] += along * nx * nx + across
    out[row, 1] += along * ny * ny + across
    out[row, 2] += along * nz * nz + across
    out[row, 3] += along * nx * ny
    out[row, 4] += along * nx * nz
    out[row, 5] += along * ny * nz


@compiled(f"void({_NUMBERS}, {_ROWS}, float64, {_ROWS})")
def add_pulled_blocks(weights: Floats, normals: Floats, tau: float, out: Floats) -> None:
    """Add the diagonal blocks of pulls on n vertices."""
    for i in range(len(weights)):
        w = weights[i]
        _add_block(out, i, w, normals[i, 0], normals[i, 1], normals[i, 2], w * tau)


@compiled(f"void(int64[:,::1], {_ROWS}, {_NUMBERS}, {_ROWS}, float64, {_ROWS})")
def add_carried_blocks(
    corners: Ints, shares: Floats, weights: Floats, normals: Floats, tau: float, out: Floats
) -> None:
    """Add the diagonal blocks of pulls on k points that n vertices carry."""
    for k in range(len(corners)):
        nx, ny, nz = normals[k, 0], normals[k, 1], normals[k, 2]
        for corner in range(3):
            w = shares[k, corner] ** 2 * weights[k]
            _add_block(out, corners[k, corner], w, nx, ny, nz, w * tau)


@compiled(f"void({_SPARSE}, {_NUMBERS}, {_NUMBERS}, {_ROWS}, {_ROWS})")
def add_smoothed_blocks(
    starts: Ints32,
    columns: Ints32,
    entries: Floats,
    weights: Floats,
    outline: Floats,
    normals: Floats,
    out: Floats,
) -> None:
    """Add the diagonal blocks of Lᵀ W L, as in :func:`add_smoothed`."""
    for i in range(len(weights)):
        nx, ny, nz = normals[i, 0], normals[i, 1], normals[i, 2]
        along, both = -outline[i], weights[i] + outline[i]
        for k in range(starts[i], starts[i + 1]):
            squared = entries[k] ** 2
            _add_block(out, columns[k], squared * along, nx, ny, nz, squared * both)


@compiled(f"void({_ROWS}, {_ROWS}, {_ROWS})")
def multiply_blocks(blocks: Floats, vectors: Floats, out: Floats) -> None:
    """Multiply n symmetric blocks with n vectors."""
    for i in range(len(vectors)):
        x, y, z = vectors[i, 0], vectors[i, 1], vectors[i, 2]
        out[i, 0] = blocks[i, 0] * x + blocks[i, 3] * y + blocks[i, 4] * z
        out[i, 1] = blocks[i, 3] * x + blocks[i, 1] * y + blocks[i, 5] * z
        out[i, 2] = blocks[i, 4] * x + blocks[i, 5] * y + blocks[i, 2] * z
