"""Branch and bound: how far a surface goes from another, from both sides.

The lower end is the distance of the farthest point met; the upper end is the largest bound of
any piece. The pieces with the largest bounds are cut until the two ends are close enough.
What suggests faces, the tree of boxes, is not believed: each bound is computed again for the
faces it named, and the farthest point is compared with every face at the end.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from meshcone.quality.deviation.cuts import choose_cuts
from meshcone.quality.deviation.equal_faces import equal_faces
from meshcone.quality.deviation.games import mixed_bound, single_face_bound
from meshcone.quality.deviation.pieces import Pieces
from meshcone.quality.deviation.placing import MOST_CUTS_DEEP, Placed
from meshcone.quality.deviation.points import Hints, KnownPoints
from meshcone.quality.deviation.triangles import Triangles
from meshcone.surface import Mesh, SurfaceTree
from meshcone.surface.arrays import Floats, Ints

# Pieces worked on at a time: their distances stay in the processor's cache.
_BLOCK = 8192
# Points that are looked up first, spread over the mesh: they decide most gates that fail.
_FIRST_LOOK = 1024
# Bounds this near to the farthest point are ties: their last digits are not chased.
_TIE = 1e-9

# For the farthest distance met so far: pieces bounded at or below this need no more work.
Level = Callable[[float], float]


@dataclass(frozen=True)
class Farthest:
    """The farthest point that was met, in the meshes' unit.

    Attributes:
        face: of the mesh.
        weights: (3,) of that face's corners.
        position: (3,).
        distance: proven lower bound on its distance.
    """

    face: int
    weights: Floats
    position: Floats
    distance: float


@dataclass(frozen=True)
class Unsettled:
    """Pieces whose bounds are above the bar, in the unit of :class:`Placed`.

    Attributes:
        rows: (k,) which.
        corners: (k, 3, 3) where they are.
        distances: (k, 3) of their corners.
        centre_distances: (k,) of their centroids.
    """

    rows: Ints
    corners: Floats
    distances: Floats
    centre_distances: Floats


class Search:
    """How far a mesh goes from its reference, known better after every run.

    Attributes:
        placed: the two meshes as the search sees them.
        pieces: what the mesh has been cut into, and what bounds each.
    """

    def __init__(self, mesh: Mesh, reference: Mesh, hints: Hints | None = None) -> None:
        """Prepare a search.

        Args:
            mesh: whose points are asked about.
            reference: in the same unit.
            hints: what is known already.

        Raises:
            InputError: a mesh has no faces or a position that is not finite.
        """
        self.placed = Placed.of(mesh, reference)
        self._triangles = Triangles(self.placed.reference)
        hints = hints or Hints(SurfaceTree(reference))
        self._points = KnownPoints(self.placed, hints, self._triangles)
        self.pieces = Pieces(self.placed.mesh.faces)
        self._equal = self._begin()

    def _begin(self) -> bool:
        """Give each face a bound: 0 where the reference has it too; whether all are like that."""
        mesh, reference = self.placed.mesh, self.placed.reference
        every = np.arange(len(mesh.faces))
        middle = int(np.abs(reference.corners.mean(axis=1)).sum(axis=1).argmin())
        to_middle = self._triangles.distances(mesh.vertices, np.full(len(mesh.vertices), middle))
        poor = to_middle[mesh.faces].max(axis=1)
        self.pieces.note(every, poor, np.full((1, len(every)), middle))
        same = equal_faces(mesh, reference)
        equal = np.flatnonzero(same >= 0)
        self.pieces.note(equal, np.full(len(equal), -1.0), same[equal][None])
        self.pieces.bound[equal] = 0
        return len(equal) == len(every)

    @property
    def upper(self) -> float:
        """Proven: no point of the mesh is farther. In the meshes' unit."""
        if self._equal:
            return 0.0
        return (self.pieces.largest_bound() + self.placed.rounding) * self.placed.unit

    def farthest(self) -> Farthest:
        """Compare the farthest point met with every face of the reference."""
        corners = self.placed.mesh.corners[self._points.farthest_face]
        weights = _weights(self._points.farthest_at, corners)
        position = weights @ corners
        return Farthest(
            face=self._points.farthest_face,
            weights=weights,
            position=position * self.placed.unit + self.placed.origin,
            distance=self.distance_at_least(position),
        )

    def distance_at_least(self, point: Floats) -> float:
        """Compare a point (3,) of :attr:`placed` with every face; in the meshes' unit."""
        height = 0.0 if self._equal else self._triangles.distance_at_least(point)
        return max(height - self.placed.rounding, 0.0) * self.placed.unit

    def known_points(self) -> tuple[Floats, Floats]:
        """The points (k, 3) of :attr:`placed` that were asked for, and their distances (k,)."""
        known = np.flatnonzero(~np.isnan(self._points.distances))
        return self._points.positions[known], self._points.distances[known]

    def run(self, level: Level, most_pieces: int) -> None:
        """Cut pieces until each is bounded by the level, or as many are made as may be.

        Args:
            level: in the meshes' unit; infinite once the question is answered.
            most_pieces: beyond the faces of the mesh, of all runs together.
        """
        unit, rounding = self.placed.unit, self.placed.rounding

        def bar() -> float:
            met = self._points.farthest
            return max(level(max(met - rounding, 0.0) * unit) / unit - rounding, met + _TIE)

        pieces = self.pieces
        left = np.flatnonzero(~pieces.cut[: pieces.count])
        left = left[pieces.bound[left] > self._points.farthest]
        self.look_up(left, bar)
        while len(left := left[pieces.bound[left] > bar()]):
            if pieces.count - pieces.faces >= most_pieces:
                # No more cuts, but each piece there is has a bound as good as can be.
                left = left[pieces.edge[left] < 0]
            if not len(left):
                break
            now, later = _largest(left, pieces.bound[left])
            known = pieces.edge[now] >= 0
            deep = pieces.depth[now] >= MOST_CUTS_DEEP
            fresh = np.concatenate([now[~known], self.split(now[known & ~deep])])
            for rows in blocks(fresh):
                self.evaluate(rows, bar)
            left = np.concatenate([later, fresh])

    def look_up(self, rows: Ints, bar: Callable[[], float]) -> None:
        """Ask for all corners of pieces, as long as the answer needs them, and bound these."""
        corners = np.unique(self.pieces.corners[rows])
        corners = corners[np.isnan(self._points.distances[corners])]
        first = corners[:: max(1, len(corners) // _FIRST_LOOK)]
        rest = np.setdiff1d(corners, first, assume_unique=True)
        for part in (first, *blocks(rest, 2 * _BLOCK)):
            self._points.look_up(part)
            if not np.isfinite(bar()):
                break
        for block in blocks(rows):
            self._guess(block)

    def _guess(self, rows: Ints) -> None:
        """Bound pieces by how far a corner is and how long the sides from it are."""
        corners = self.pieces.corners[rows]
        positions, distances = self._points.positions[corners], self._points.distances[corners]
        distances = np.where(np.isnan(distances), np.inf, distances)  # not asked for
        sides = positions[:, [1, 2, 0]] - positions
        lengths = np.sqrt(np.einsum("kij,kij->ki", sides, sides))
        reach = distances + np.maximum(lengths, lengths[:, [2, 0, 1]])
        best = reach.argmin(axis=1)[:, None]
        nearest = np.take_along_axis(self._points.nearest[corners], best, 1)
        self.pieces.note(rows, np.take_along_axis(reach, best, 1)[:, 0], nearest.T)

    def evaluate(self, rows: Ints, bar: Callable[[], float], *, creases: bool = True) -> Unsettled:
        """Bound pieces as well as is known; settle where those above the bar would be cut.

        Args:
            rows: (k,) pieces.
            bar: what they may be bounded by.
            creases: whether the largest distance is looked for; see :mod:`.cuts`.
        """
        pieces, points = self.pieces, self._points
        rows = rows[pieces.bound[rows] > bar()]
        corners = pieces.corners[rows]
        positions, distances = points.positions[corners], points.distances[corners]
        # Two searches in three are spared by looking at the corners' faces first.
        faces = np.empty((4, len(rows)), dtype=np.int64)
        faces[:3] = points.nearest[corners].T
        table = np.empty((3, 4, len(rows)))
        for face in range(3):
            for corner in range(3):
                table[corner, face] = (
                    distances[:, corner]
                    if corner == face
                    else self._triangles.distances(positions[:, corner], faces[face])
                )
        left = self._note(rows, table[:, :3], faces[:3], bar)
        distances = distances[left]
        rows, positions, table, faces = (
            rows[left],
            positions[left],
            table[:, :, left],
            faces[:, left],
        )
        faces[3], centre = points.ask(positions.mean(axis=1), pieces.face[rows].astype(np.int64))
        for corner in range(3):
            table[corner, 3] = self._triangles.distances(positions[:, corner], faces[3])
        left = self._note(rows, table, faces, bar, tried=3)
        rows = rows[left]
        pieces.edge[rows], pieces.at[rows] = choose_cuts(
            positions[left],
            table[:, :, left],
            centre[left],
            self.placed.reference.corners[faces[3, left]],
            pieces.depth[rows],
            creases,
        )
        return Unsettled(rows, positions[left], distances[left], centre[left])

    def _note(
        self, rows: Ints, table: Floats, faces: Ints, bar: Callable[[], float], tried: int = 0
    ) -> Ints:
        """Take the bounds of (3, f, k) distances; the places of pieces still above the bar.

        The bounds by the first ``tried`` faces have been taken already.
        """
        bound, best = single_face_bound(table)
        self.pieces.note(rows, bound, faces[best, np.arange(len(best))][None])
        left = np.flatnonzero(self.pieces.bound[rows] > bar())
        if not len(left):
            return left
        bound, weights = mixed_bound(table[:, :, left], tried)
        self.pieces.note(rows[left], bound, faces[:, left], weights)
        return left[self.pieces.bound[rows[left]] > bar()]

    def split(self, rows: Ints) -> Ints:
        """Cut pieces where it was settled; the halves, of which twice as many come back."""
        pieces, points = self.pieces, self._points
        order, edge = np.arange(len(rows)), pieces.edge[rows].astype(np.int64)
        corners = pieces.corners[rows]
        start, end = (points.positions[corners[order, (edge + turn) % 3]] for turn in range(2))
        cut = start + pieces.at[rows][:, None] * (end - start)
        return pieces.split(rows, points.add(cut, pieces.face[rows].astype(np.int64)))


def blocks(rows: Ints, size: int = _BLOCK) -> list[Ints]:
    """Rows in portions that are worked on at a time."""
    return [rows[start : start + size] for start in range(0, len(rows), size)]


def _largest(rows: Ints, bounds: Floats) -> tuple[Ints, Ints]:
    """The pieces to be worked on now, those with the largest bounds, and the others."""
    if len(rows) <= _BLOCK:
        return rows, rows[:0]
    order = np.argpartition(bounds, len(rows) - _BLOCK)
    return rows[order[-_BLOCK:]], rows[order[:-_BLOCK]]


def _weights(point: Floats, corners: Floats) -> Floats:
    """Weights (3,) of a triangle's corners that give the point nearest to one; they add up to 1."""
    equations = np.vstack([corners.T, np.ones(3)])
    weights, _ = nnls(equations, np.append(point, 1.0))
    return np.asarray(weights / weights.sum())
