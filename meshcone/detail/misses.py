"""Where a mesh misses its reference: face by face, and side by side."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from meshcone.surface import ClosestPoints, Mesh, SurfaceTree, sample_surface
from meshcone.surface.arrays import Bools, Floats, row_lengths
from meshcone.surface.closest import barycentric_weights

# Corners are pulled onto the reference in any case. The middles of the sides come first.
_PLACES = np.array(
    [
        [1 / 2, 1 / 2, 0],
        [0, 1 / 2, 1 / 2],
        [1 / 2, 0, 1 / 2],
        [1 / 3, 1 / 3, 1 / 3],
        [2 / 3, 1 / 6, 1 / 6],
        [1 / 6, 2 / 3, 1 / 6],
        [1 / 6, 1 / 6, 2 / 3],
    ]
)
_FEWEST_SAMPLES = 20_000
# Points on a mesh, at least: at seven on each of a few faces, chance outweighs what a level does.
_FEWEST_PLACES = 5_000
_SAGITTA = 0.25  # of a chord's length
_ON_SIDE = 1e-6  # barycentric weight of the corner across from it


@dataclass(frozen=True)
class Target:
    """A reference, prepared to be missed.

    Attributes:
        tree: closest points on it.
        points: (s, 3) samples of it, and its vertices.
    """

    tree: SurfaceTree
    points: Floats

    @staticmethod
    def of(reference: Mesh, seed: int) -> Target:
        """Sample a reference."""
        count = max(_FEWEST_SAMPLES, 2 * len(reference.vertices))
        samples = sample_surface(reference, count, seed).points
        corners = reference.vertices[reference.used_vertices]
        return Target(SurfaceTree(reference), np.concatenate([samples, corners]))


@dataclass(frozen=True)
class Misses:
    """How far a mesh is from its reference, in the unit of both.

    Attributes:
        scores: (f,) the squared distance that each face is to blame for, times area: of its own
            points, and of the reference's points that it is closest to.
        sides: (f, 3) distance of the middle of each side from the reference.
        mean: mean distance, over points of both.
        farthest: largest distance of any point.
    """

    scores: Floats
    sides: Floats
    mean: float
    farthest: float

    @property
    def total(self) -> float:
        """The squared distance that all faces are to blame for."""
        return float(self.scores.sum())

    @staticmethod
    def of(mesh: Mesh, target: Target, lost: Bools | None = None) -> Misses:
        """Measure a mesh against its reference.

        Args:
            mesh: the mesh.
            target: the reference.
            lost: (f,) faces of parts that the reference lacks, which are to blame for nothing.
        """
        count = len(mesh.faces)
        own = np.einsum("pi,mik->mpk", _places(count), mesh.corners).reshape(-1, 3)
        found = target.tree.closest(own)
        there = found.distances.reshape(count, -1)
        off = np.where(_beyond_border(target.tree.mesh, found), 0.0, found.distances)
        back = SurfaceTree(mesh).closest(target.points)
        share = float(mesh.face_areas.sum()) / len(target.points)
        counted = np.where(_beyond_border(mesh, back), 0.0, back.distances)
        blamed = np.bincount(back.faces, counted**2, count) * share
        areas = mesh.face_areas
        mean_there = float(np.average(there.mean(axis=1), weights=areas))
        scores = blamed + areas * (off.reshape(count, -1) ** 2).mean(axis=1)
        return Misses(
            scores=scores if lost is None else np.where(lost, 0.0, scores),
            sides=there[:, :3],
            mean=float((mean_there + back.distances.mean()) / 2),
            farthest=float(max(there.max(), back.distances.max())),
        )


def _places(faces: int) -> Floats:
    """Barycentric coordinates (p, 3) of the points on each of so many faces, middles first."""
    steps = int(np.ceil(np.sqrt(_FEWEST_PLACES / max(faces, 1))))
    if steps**2 <= len(_PLACES):
        return _PLACES
    # The centres of the triangles in a lattice, those that point up and those that point down.
    i, j = np.divmod(np.arange(steps**2), steps)
    centres = [np.column_stack([i, j]) + third for third in (1 / 3, 2 / 3)]
    inside = np.concatenate([each[each.sum(axis=1) < steps] for each in centres]) / steps
    return np.concatenate([_PLACES[:3], np.column_stack([inside, 1 - inside.sum(axis=1)])])


def _beyond_border(mesh: Mesh, found: ClosestPoints) -> Bools:
    """Which points (k,) lie beyond a mesh's end: it lacks a part there, and detail does not help.

    They are closest to an open border, and farther from it than a side that bends is from its
    chord.
    """
    sides, faces, corners = mesh.border_sides, found.faces, mesh.border_vertices[mesh.faces]
    beside = np.flatnonzero(np.asarray(corners.any(axis=1))[faces])
    weights = barycentric_weights(found.points[beside], mesh, faces[beside])
    across = np.roll(weights, -2, axis=1)  # of the corner across from each side
    lengths = row_lengths((mesh.corners - np.roll(mesh.corners, -1, axis=1)).reshape(-1, 3))
    sizes = lengths.reshape(-1, 3).max(axis=1)
    beyond: Bools = np.zeros(len(faces), dtype=bool)
    on_side = sides[faces[beside]] & (across < _ON_SIDE)
    at_corner = corners[faces[beside]] & (weights > 1 - _ON_SIDE)
    on_border = np.asarray((on_side | at_corner).any(axis=1))
    beyond[beside] = on_border & (found.distances[beside] > _SAGITTA * sizes[faces[beside]])
    return beyond
