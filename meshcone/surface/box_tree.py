"""A binary tree of boxes over triangles, which refits when its triangles move.

A node is split at the median of its faces' centres along the longest axis. A search descends into
the nearer child first and leaves out what is farther than the best face so far. Which face is the
best at the beginning, that of the point before, decides how long a search takes
and never what it finds: the least distance of all faces, as it is computed, and of equally close
faces the one of the lowest index. So the tree's shape leaves no trace in the answer either.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from meshcone.surface.arrays import Bools, Floats, Ints
from meshcone.surface.box_search import search
from meshcone.surface.compiled import compiled

_LEAF = 2  # faces, at most
_THIN = 1e-4  # height over longest side


@dataclass(frozen=True)
class BoxTree:
    """The tree of m faces.

    Attributes:
        faces: (m, 3) vertex indices.
        order: (m,) the faces, leaf by leaf.
        spans: (nodes, 2) where the faces of each node begin and end in that order.
        children: (nodes,) the first of a node's two children, which the other follows; −1 in a
            leaf.
        boxes: (nodes, 6) smallest and largest corner of each node.
        corners: (m, 9) the corners of the faces, in the tree's order.
        thin: (m,) which of these faces are much longer than high.
    """

    faces: Ints
    order: Ints
    spans: Ints
    children: Ints
    boxes: Floats
    corners: Floats
    thin: Bools

    @staticmethod
    def of(vertices: Floats, faces: Ints) -> BoxTree:
        """Build the tree over (n, 3) positions; O(m log m)."""
        order = np.arange(len(faces))
        spans = np.empty((2 * len(faces) + 1, 2), dtype=np.int64)
        children = np.empty(len(spans), dtype=np.int64)
        a, b, c = (vertices.take(corner, axis=0) for corner in faces.T)
        nodes = _split(a + b + c, order, spans, children)
        spans, children = spans[:nodes].copy(), children[:nodes].copy()
        return _fitted(faces, order, spans, children, vertices)

    def moved_to(self, vertices: Floats) -> BoxTree:
        """Return the tree of the same faces over other positions (n, 3); O(m)."""
        return _fitted(self.faces, self.order, self.spans, self.children, vertices)

    def search(self, points: Floats) -> tuple[Floats, Ints, Floats]:
        """Find the closest point on the faces to each of (k, 3) points.

        Returns:
            The squared distances (k,), the faces (k,) and the points on them (k, 3). For a point
            that is not finite: infinity, face 0, and no number.
        """
        count = len(points)
        squared, found = np.full(count, np.inf), np.zeros(count, dtype=np.int64)
        closest = np.full((count, 3), np.nan)
        if count and len(self.faces):
            tree = self.order, self.spans, self.children, self.boxes, self.corners, self.thin
            search(points, *tree, squared, found, closest)
        return squared, found, closest


def _fitted(faces: Ints, order: Ints, spans: Ints, children: Ints, vertices: Floats) -> BoxTree:
    corners = vertices.take(faces.take(order, axis=0), axis=0).reshape(-1, 9)
    thin, boxes = np.empty(len(faces), dtype=np.bool_), np.empty((len(children), 6))
    _mark_thin(corners, thin)
    _fit_boxes(corners, spans, children, boxes)
    return BoxTree(faces, order, spans, children, boxes, corners, thin)


@compiled()
def _longest_axis(centres: Floats, order: Ints, begin: int, end: int) -> int:
    longest, extent = 0, -1.0
    for axis in range(3):
        low = high = centres[order[begin], axis]
        for place in range(begin + 1, end):
            here = centres[order[place], axis]
            low, high = min(low, here), max(high, here)
        if high - low > extent:
            longest, extent = axis, high - low
    return longest


@compiled()
def _select(centres: Floats, order: Ints, axis: int, begin: int, middle: int, end: int) -> None:
    """Put the smaller half of a stretch of ``order`` before its middle (Hoare, "Find", 1961)."""
    left, right = begin, end - 1
    while left < right:
        pivot = centres[order[(left + right) // 2], axis]
        up, down = left, right
        while up <= down:
            while centres[order[up], axis] < pivot:
                up += 1
            while centres[order[down], axis] > pivot:
                down -= 1
            if up <= down:
                order[up], order[down] = order[down], order[up]
                up, down = up + 1, down - 1
        if middle <= down:
            right = down
        elif middle >= up:
            left = up
        else:
            return


@compiled("int64(float64[:,::1], int64[::1], int64[:,::1], int64[::1])")
def _split(centres: Floats, order: Ints, spans: Ints, children: Ints) -> int:
    """Sort ``order`` into leaves, write the nodes level by level, and count them."""
    count, node = 1, 0
    spans[0, 0], spans[0, 1] = 0, len(order)
    while node < count:
        begin, end = spans[node, 0], spans[node, 1]
        children[node] = -1
        if end - begin > _LEAF:
            middle = (begin + end) // 2
            _select(centres, order, _longest_axis(centres, order, begin, end), begin, middle, end)
            children[node] = count
            spans[count, 0], spans[count, 1] = begin, middle
            spans[count + 1, 0], spans[count + 1, 1] = middle, end
            count += 2
        node += 1
    return count


@compiled("void(float64[:,::1], boolean[::1])")
def _mark_thin(corners: Floats, thin: Bools) -> None:
    for place in range(len(corners)):
        t = corners[place]
        ux, uy, uz = t[3] - t[0], t[4] - t[1], t[5] - t[2]
        vx, vy, vz = t[6] - t[0], t[7] - t[1], t[8] - t[2]
        wx, wy, wz = vx - ux, vy - uy, vz - uz
        x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        longest = max(ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz)
        longest = max(longest, wx * wx + wy * wy + wz * wz)
        thin[place] = not x * x + y * y + z * z > (_THIN * longest) ** 2


@compiled("void(float64[:,::1], int64[:,::1], int64[::1], float64[:,::1])")
def _fit_boxes(corners: Floats, spans: Ints, children: Ints, boxes: Floats) -> None:
    for node in range(len(children) - 1, -1, -1):
        child = children[node]
        for k in range(3):
            low, high = np.inf, -np.inf
            if child >= 0:
                low = min(boxes[child, k], boxes[child + 1, k])
                high = max(boxes[child, 3 + k], boxes[child + 1, 3 + k])
            else:
                for place in range(spans[node, 0], spans[node, 1]):
                    for corner in range(k, 9, 3):
                        here = corners[place, corner]
                        low, high = min(low, here), max(high, here)
            boxes[node, k], boxes[node, 3 + k] = low, high
