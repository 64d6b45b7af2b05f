"""The search for closest points in a tree of boxes.

What :func:`search` calls stands above it, because it is compiled when it is read, and in this file,
because numba compiles a function again when that file has changed and no other.
"""

from __future__ import annotations

import numpy as np

from meshcone.surface.arrays import Bools, Floats, Ints
from meshcone.surface.compiled import compiled

_DEEPEST = 128
# Distances to boxes and to faces are rounded in different ways; relative to all coordinates.
_ROUNDING = 4e-15

_Found = tuple[float, float, float, float]  # a squared distance, and the point there


_TREE = "int64[::1], int64[:,::1], int64[::1], float64[:,::1], float64[:,::1], boolean[::1]"


@compiled()
def _to_point(x: float, y: float, z: float, qx: float, qy: float, qz: float) -> _Found:
    dx, dy, dz = x - qx, y - qy, z - qz
    return dx * dx + dy * dy + dz * dz, qx, qy, qz


@compiled()
def _to_side(
    x: float,
    y: float,
    z: float,
    ax: float,
    ay: float,
    az: float,
    bx: float,
    by: float,
    bz: float,
) -> _Found:
    if bx < ax or (bx == ax and (by < ay or (by == ay and bz < az))):
        ax, ay, az, bx, by, bz = bx, by, bz, ax, ay, az
    ux, uy, uz = bx - ax, by - ay, bz - az
    along, length = ux * (x - ax) + uy * (y - ay) + uz * (z - az), ux * ux + uy * uy + uz * uz
    if not along > 0:
        return _to_point(x, y, z, ax, ay, az)
    if along >= length:
        return _to_point(x, y, z, bx, by, bz)
    s = along / length
    return _to_point(x, y, z, ax + s * ux, ay + s * uy, az + s * uz)


@compiled()
def _nearer(first: _Found, second: _Found) -> _Found:
    return second if second[0] < first[0] else first


@compiled()
def _to_face(x: float, y: float, z: float, corners: Floats, place: int, thin: bool) -> _Found:
    """Find the closest point of a face.

    A corner or a side is measured in a way that does not depend on the face it is a part of:
    faces that share it are equally close to the last bit. What is found lies on the face, whatever
    the rounding. Within a thin face rounding may move it far: there its sides are asked as well.

    Source: Ericson, "Real-Time Collision Detection" (2005), section 5.1.5.
    """
    ax, ay, az = corners[place, 0], corners[place, 1], corners[place, 2]
    bx, by, bz = corners[place, 3], corners[place, 4], corners[place, 5]
    cx, cy, cz = corners[place, 6], corners[place, 7], corners[place, 8]
    ux, uy, uz, vx, vy, vz = bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az
    px, py, pz = x - ax, y - ay, z - az
    d1, d2 = ux * px + uy * py + uz * pz, vx * px + vy * py + vz * pz
    if d1 <= 0 and d2 <= 0:
        return _to_point(x, y, z, ax, ay, az)
    uv = ux * vx + uy * vy + uz * vz
    d3, d4 = d1 - (ux * ux + uy * uy + uz * uz), d2 - uv
    if d3 >= 0 and d4 <= d3:
        return _to_point(x, y, z, bx, by, bz)
    d5, d6 = d1 - uv, d2 - (vx * vx + vy * vy + vz * vz)
    if d6 >= 0 and d5 <= d6:
        return _to_point(x, y, z, cx, cy, cz)
    # Weights of the corners times the squared length of the normal, by products that cancel less
    # than those of the d do.
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    b = nx * (py * vz - pz * vy) + ny * (pz * vx - px * vz) + nz * (px * vy - py * vx)
    c = nx * (uy * pz - uz * py) + ny * (uz * px - ux * pz) + nz * (ux * py - uy * px)
    a = nx * nx + ny * ny + nz * nz - b - c
    if not thin:
        if c <= 0 and d1 >= 0 and d3 <= 0:
            return _to_side(x, y, z, ax, ay, az, bx, by, bz)
        if b <= 0 and d2 >= 0 and d6 <= 0:
            return _to_side(x, y, z, cx, cy, cz, ax, ay, az)
        if a <= 0 and d4 - d3 >= 0 and d5 - d6 >= 0:
            return _to_side(x, y, z, bx, by, bz, cx, cy, cz)
    a, b, c = max(a, 0.0), max(b, 0.0), max(c, 0.0)
    found = np.inf, ax, ay, az
    if a + b + c > 0:
        v, w = b / (a + b + c), c / (a + b + c)
        found = _to_point(x, y, z, ax + v * ux + w * vx, ay + v * uy + w * vy, az + v * uz + w * vz)
    if thin:
        found = _nearer(found, _to_side(x, y, z, ax, ay, az, bx, by, bz))
        found = _nearer(found, _to_side(x, y, z, bx, by, bz, cx, cy, cz))
        found = _nearer(found, _to_side(x, y, z, cx, cy, cz, ax, ay, az))
    return found


@compiled()
def _to_box(x: float, y: float, z: float, boxes: Floats, node: int) -> float:
    dx = max(max(boxes[node, 0] - x, x - boxes[node, 3]), 0.0)
    dy = max(max(boxes[node, 1] - y, y - boxes[node, 4]), 0.0)
    dz = max(max(boxes[node, 2] - z, z - boxes[node, 5]), 0.0)
    return float(dx * dx + dy * dy + dz * dz)


@compiled(f"void(float64[:,::1], {_TREE}, float64[::1], int64[::1], float64[:,::1])")
def search(
    points: Floats,
    order: Ints,
    spans: Ints,
    children: Ints,
    boxes: Floats,
    corners: Floats,
    thin: Bools,
    squared: Floats,
    found: Ints,
    closest: Floats,
) -> None:
    """Write the closest points on a tree's faces; see :class:`BoxTree` for the tree's arrays.

    Args:
        points: (k, 3) where from.
        order: of the tree.
        spans: of the tree.
        children: of the tree.
        boxes: of the tree.
        corners: of the tree.
        thin: of the tree.
        squared: (k,) filled with the squared distances, where the point is finite.
        found: (k,) filled with the faces.
        closest: (k, 3) filled with the points on them.
    """
    waiting, bounds = np.empty(_DEEPEST, np.int64), np.empty(_DEEPEST)
    extent = np.abs(boxes[0]).max()
    at = -1
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        if not np.isfinite(x + y + z):
            continue
        rounding = _ROUNDING * max(extent, max(abs(x), max(abs(y), abs(z))))
        best = np.inf if at < 0 else _to_face(x, y, z, corners, at, thin[at])[0]
        limit = (np.sqrt(best) + rounding) ** 2
        top, waiting[0], bounds[0] = 0, 0, 0.0
        while top >= 0:
            node, bound = waiting[top], bounds[top]
            top -= 1
            while bound <= limit and children[node] >= 0:
                near = children[node]
                far = near + 1
                bound, there = _to_box(x, y, z, boxes, near), _to_box(x, y, z, boxes, far)
                if there < bound:
                    near, far, bound, there = far, near, there, bound
                if there <= limit:
                    top += 1
                    waiting[top], bounds[top] = far, there
                node = near
            if bound > limit:
                continue
            for place in range(spans[node, 0], spans[node, 1]):
                d = _to_face(x, y, z, corners, place, thin[place])[0]
                if d < best or (d == best and order[place] < order[at]):
                    best, at = d, place
                    limit = (np.sqrt(best) + rounding) ** 2
        if at >= 0:
            squared[i], found[i] = best, order[at]
            _, qx, qy, qz = _to_face(x, y, z, corners, at, thin[at])
            closest[i, 0], closest[i, 1], closest[i, 2] = qx, qy, qz
