"""Swaps diagonals where the other one lies closer to the reference."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meshcone.detail.divided_mesh import DividedMesh, edge_of_sides
from meshcone.surface import Mesh, SurfaceTree
from meshcone.surface.arrays import Bools, Floats, Ints, normalized, row_dot, row_lengths

_ALONG = (0.25, 0.5, 0.75)  # where a diagonal is looked at
PASSES = 4
_GAIN = 0.15  # the other diagonal is closer by at least this share
_FLOOR = 2e-5  # of the radius: nearer than this, nothing is to be gained
_FOLDED = 0.5  # least cosine between a new face and the two it replaces
_WORST_ASPECT = 8.0  # of a new face, unless one of the old is worse


def flip_inside(divided: DividedMesh, tree: SurfaceTree) -> DividedMesh:
    """Swap diagonals of pairs of faces that lie in one parent.

    Only where the pair is convex in its parent, so that the faces still tile it. A diagonal is
    swapped if the other one lies closer to the reference, and neither folds the surface nor
    makes a sliver.

    Args:
        divided: the mesh, where it was moved to.
        tree: closest points on the reference.
    """
    for _ in range(PASSES):
        pairs = Pairs.inside(divided)
        gain = pairs.gain(divided.mesh, tree)
        chosen = pairs.independent(gain, len(divided.mesh.faces))
        if not len(chosen):
            break
        some = pairs.only(chosen)
        divided = DividedMesh(
            Mesh(divided.mesh.vertices, some.swapped(divided.mesh.faces)),
            divided.parents,
            some.swapped(divided.corners),
            divided.exponent,
            divided.sources,
        )
    return divided


@dataclass(frozen=True)
class Pairs:
    """Pairs of faces with a side in common, whose other diagonal may take its place.

    Attributes:
        faces: (k, 2) the two faces.
        turns: (k, 2) the corner of either at which the common side begins.
        ring: (k, 4) the ends a and b of the side, and the corners c and d of first and second
            face across from it.
    """

    faces: Ints
    turns: Ints
    ring: Ints

    @staticmethod
    def of(mesh: Mesh) -> Pairs:
        """Find all pairs that run around alike, and whose other diagonal is not a side yet."""
        sides = edge_of_sides(mesh).ravel()
        order = np.argsort(sides, kind="stable")
        uses = np.bincount(sides, minlength=len(mesh.edges))
        first = order[(np.cumsum(uses) - uses)[uses == 2]]
        second = order[(np.cumsum(uses) - uses)[uses == 2] + 1]
        faces, turns = np.divmod(np.stack([first, second], axis=1), 3)
        every = Pairs(faces, turns, np.empty((len(faces), 4), dtype=np.int64))
        ring = np.stack(every.around(mesh.faces), axis=1)
        pairs = Pairs(faces, turns, ring)
        alike = mesh.faces[faces[:, 1], (turns[:, 1] + 1) % 3] == ring[:, 0]
        return pairs.only(alike & (ring[:, 2] != ring[:, 3]) & ~_known(mesh, ring[:, 2:]))

    @staticmethod
    def inside(divided: DividedMesh) -> Pairs:
        """Find the pairs inside a parent that are convex there."""
        pairs = Pairs.of(divided.mesh)
        first, second = pairs.faces.T
        pairs = pairs.only(divided.parents[first] == divided.parents[second])
        a, b, c, d = (place[:, :2] for place in pairs.around(divided.corners))
        return pairs.only((_turn(a, d, c) > 0) & (_turn(d, b, c) > 0))

    def only(self, rows: Bools | Ints) -> Pairs:
        """Return some of the pairs."""
        return Pairs(self.faces[rows], self.turns[rows], self.ring[rows])

    def around(self, table: NDArray[Any]) -> list[NDArray[Any]]:
        """What a table (f, 3, ...) of corners has at a, b, c and d, each (k, ...)."""
        first, second = self.faces.T
        turn, other = self.turns.T
        return [
            table[first, turn],
            table[first, (turn + 1) % 3],
            table[first, (turn + 2) % 3],
            table[second, (other + 2) % 3],
        ]

    def gain(self, mesh: Mesh, tree: SurfaceTree) -> Floats:
        """How much closer (k,) the other diagonal comes; 0 where it must not take its place."""
        a, b, c, d = self.ring.T
        found = np.zeros(len(self.ring))
        old = _distance(mesh, tree, a, b)
        rows = np.flatnonzero(old > _FLOOR)
        if not len(rows):
            return found
        a, b, c, d = (each[rows] for each in (a, b, c, d))
        new = _distance(mesh, tree, c, d)
        before = [_area_vector(mesh, a, b, c), _area_vector(mesh, b, a, d)]
        after = [_area_vector(mesh, a, d, c), _area_vector(mesh, d, b, c)]
        facing = normalized(before[0] + before[1])
        flat = np.min([row_dot(normalized(each), facing) for each in after], axis=0) > _FOLDED
        aspects_before = np.maximum(_aspect(mesh, a, b, c), _aspect(mesh, b, a, d))
        aspects_after = np.maximum(_aspect(mesh, a, d, c), _aspect(mesh, d, b, c))
        shaped = (aspects_after < _WORST_ASPECT) | (aspects_after < aspects_before)
        good = flat & shaped & (new < (1 - _GAIN) * old[rows])
        found[rows[good]] = (old[rows] - new)[good]
        return found

    def independent(self, gain: Floats, faces: int) -> Ints:
        """Choose pairs that gain, the best first, no two with a face or a new edge in common."""
        taken = np.zeros(faces, dtype=bool)
        edges: set[tuple[int, int]] = set()
        chosen = []
        order = np.argsort(-gain, kind="stable")
        for pair in order[gain[order] > 0].tolist():
            first, second = self.faces[pair]
            c, d = sorted(self.ring[pair, 2:].tolist())
            if not (taken[first] or taken[second] or (c, d) in edges):
                taken[first] = taken[second] = True
                edges.add((c, d))
                chosen.append(pair)
        return np.array(chosen, dtype=np.int64)

    def swapped(self, table: NDArray[Any]) -> NDArray[Any]:
        """Swap the diagonals of all pairs in a table (f, 3, ...) of corners."""
        changed = table.copy()
        a, b, c, d = self.around(table)
        changed[self.faces[:, 0]] = np.stack([a, d, c], axis=1)
        changed[self.faces[:, 1]] = np.stack([d, b, c], axis=1)
        return changed


def _known(mesh: Mesh, pairs: Ints) -> Bools:
    """Whether (k, 2) pairs of vertices are edges already."""
    count = len(mesh.vertices)
    keys = mesh.edges[:, 0] * count + mesh.edges[:, 1]
    wanted = pairs.min(axis=1, initial=count) * count + pairs.max(axis=1, initial=0)
    places = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
    return np.asarray(keys[places] == wanted)


def _turn(p: Ints, q: Ints, r: Ints) -> Ints:
    """Twice the signed areas (k,) of triangles in the plane."""
    one, other = q - p, r - p
    return np.asarray(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0])


def _distance(mesh: Mesh, tree: SurfaceTree, start: Ints, end: Ints) -> Floats:
    """Distance (k,) of a line between two vertices from the reference, at its farthest place."""
    p, q = mesh.vertices[start], mesh.vertices[end]
    places = [tree.closest((1 - t) * p + t * q).distances for t in _ALONG]
    return np.asarray(np.max(places, axis=0))


def _area_vector(mesh: Mesh, p: Ints, q: Ints, r: Ints) -> Floats:
    corner = mesh.vertices[p]
    return np.asarray(np.cross(mesh.vertices[q] - corner, mesh.vertices[r] - corner))


def _aspect(mesh: Mesh, p: Ints, q: Ints, r: Ints) -> Floats:
    """Longest side over the height of the inscribed circle, 1 for an equilateral triangle."""
    v = mesh.vertices
    sides = [row_lengths(v[i] - v[j]) for i, j in ((p, q), (q, r), (r, p))]
    area = np.maximum(row_lengths(_area_vector(mesh, p, q, r)), 1e-300)
    return np.asarray(np.max(sides, axis=0) * np.sum(sides, axis=0) / (2 * np.sqrt(3) * area))
