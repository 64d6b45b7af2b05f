"""Splits polygons into triangles for the solver; the file keeps its polygons.

A convex polygon is a fan from its first corner, a concave quad a fan from its reflex
corner, and a larger concave polygon is cut ear by ear (Meisters 1975) in the plane of
its Newell normal.
"""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray

# Cutting ears is quadratic in the corners of one polygon. This bounds the work a whole file can
# ask for to a few seconds; polygons beyond it become plain fans.
_EAR_BUDGET = 20_000_000
_EAR_OVERHEAD = 200

_FLAT = 1e-12


def triangulate(
    points: NDArray[np.float64], sizes: NDArray[np.int64]
) -> tuple[NDArray[np.int64], int]:
    """Split polygons of at least three corners into triangles.

    Args:
        points: (c, 3) positions of all corners, polygon after polygon.
        sizes: (p,) corners of each polygon.

    Returns:
        (sum(sizes - 2), 3) triangles as rows of ``points``, polygon after polygon, and
        the number of concave polygons that were fanned because they are too many or too large.
    """
    starts = np.cumsum(sizes) - sizes
    outputs = np.cumsum(sizes - 2) - (sizes - 2)
    triangles = np.empty((int((sizes - 2).sum()), 3), dtype=np.int64)
    budget = _EAR_BUDGET
    fanned = 0
    order = np.argsort(sizes, kind="stable")
    boundaries = np.flatnonzero(np.diff(sizes[order])) + 1
    for polygons in np.split(order, boundaries):
        if len(polygons) == 0:
            continue
        size = int(sizes[polygons[0]])
        corners = starts[polygons][:, None] + np.arange(size)
        rows = outputs[polygons][:, None] + np.arange(size - 2)
        if size == 3:
            triangles[rows[:, 0]] = corners
            continue
        turns = _turns(points[corners])
        concave = (turns < 0).any(axis=1)
        tips = np.argmin(turns, axis=1) if size == 4 else np.zeros(len(polygons), dtype=np.int64)
        tips[~concave] = 0
        triangles[rows] = _fans(corners, tips)
        if size == 4:
            continue
        for polygon in np.flatnonzero(concave):
            budget -= size * max(size, _EAR_OVERHEAD)
            if budget < 0:
                fanned += 1
                continue
            ears = _cut_ears(_flatten(points[corners[polygon]]))
            triangles[rows[polygon]] = corners[polygon][ears]
    return triangles, fanned


def _newell(loops: NDArray[np.float64]) -> NDArray[np.float64]:
    """(k, 3) area vectors of (k, n, 3) closed loops (Sutherland et al. 1974)."""
    centred = loops - loops[:, :1]
    area: NDArray[np.float64] = np.cross(centred, np.roll(centred, -1, axis=1)).sum(axis=1)
    return area


def _turns(loops: NDArray[np.float64]) -> NDArray[np.float64]:
    """(k, n) signed turn at each corner: negative where the loop is reflex, 0 where straight."""
    incoming = loops - np.roll(loops, 1, axis=1)
    outgoing = np.roll(loops, -1, axis=1) - loops
    area = _newell(loops)
    turn = (np.cross(incoming, outgoing) * area[:, None]).sum(axis=2)
    scale = (area * area).sum(axis=1, keepdims=True)
    signed: NDArray[np.float64] = np.where(np.abs(turn) <= _FLAT * scale, 0.0, turn)
    return signed


def _fans(corners: NDArray[np.int64], tips: NDArray[np.int64]) -> NDArray[np.int64]:
    """(k, n - 2, 3) fans of (k, n) loops, each from its own tip."""
    count, size = corners.shape
    turned = (tips[:, None] + np.arange(size)) % size
    loop = np.take_along_axis(corners, turned, axis=1)
    tip = np.broadcast_to(loop[:, :1], (count, size - 2))
    return np.stack([tip, loop[:, 1:-1], loop[:, 2:]], axis=2)


def _flatten(loop: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, 2) the loop seen along its own normal, counter-clockwise."""
    area = _newell(loop[None])[0]
    drop = int(np.argmax(np.abs(area)))
    first, second = ((1, 2), (2, 0), (0, 1))[drop]
    flat = loop[:, [first, second]]
    return flat if area[drop] >= 0 else flat * (1.0, -1.0)


def _cut_ears(loop: NDArray[np.float64]) -> NDArray[np.int64]:
    """(n - 2, 3) triangles of a counter-clockwise planar loop of (n, 2) points.

    A loop that crosses itself may run out of ears; what is left of it becomes a fan.
    """
    size = len(loop)
    previous = np.roll(np.arange(size), 1).tolist()
    following = np.roll(np.arange(size), -1).tolist()
    reflex = np.zeros(size, dtype=bool)
    for corner in range(size):
        reflex[corner] = _turn(loop, previous[corner], corner, following[corner]) <= 0
    waiting = deque(range(size))
    queued = [True] * size
    ears: list[tuple[int, int, int]] = []
    while waiting and len(ears) < size - 3:
        tip = waiting.popleft()
        queued[tip] = False
        left, right = previous[tip], following[tip]
        if reflex[tip] or _holds_any(loop, left, tip, right, reflex):
            continue
        ears.append((left, tip, right))
        following[left], previous[right] = right, left
        previous[tip] = -1
        for corner in (left, right):
            turn = _turn(loop, previous[corner], corner, following[corner])
            reflex[corner] = turn <= 0
            if not queued[corner]:
                queued[corner] = True
                waiting.append(corner)
    start = next(corner for corner in range(size) if previous[corner] >= 0)
    middle = following[start]
    while following[middle] != start:
        ears.append((start, middle, following[middle]))
        middle = following[middle]
    return np.array(ears, dtype=np.int64)


def _turn(loop: NDArray[np.float64], left: int, tip: int, right: int) -> float:
    a, b, c = loop[left], loop[tip], loop[right]
    return float((b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0]))


def _holds_any(
    loop: NDArray[np.float64], left: int, tip: int, right: int, reflex: NDArray[np.bool_]
) -> bool:
    """Whether a reflex corner lies in the triangle: only those can (ElGindy et al. 1993)."""
    others = reflex.copy()
    others[[left, tip, right]] = False
    points = loop[others]
    inside = np.ones(len(points), dtype=bool)
    for start, end in ((left, tip), (tip, right), (right, left)):
        edge = loop[end] - loop[start]
        offset = points - loop[start]
        inside &= edge[0] * offset[:, 1] - edge[1] * offset[:, 0] >= 0
    # A loop with a hole is cut open by a bridge whose corners appear twice: a twin is no obstacle.
    for corner in (left, tip, right):
        inside &= (points != loop[corner]).any(axis=1)
    return bool(inside.any())
