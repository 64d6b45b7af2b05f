"""Whether an answer is worse than its input anywhere it counts.

A mean over samples can fall while one corner is torn off, faces turn over or pass through
each other. So an answer is held against its input on several counts at once, over samples
drawn with seeds that nothing else uses: what was minimised must not be its own judge.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from meshcone.quality.closeness import Distances, Gain, Probes
from meshcone.quality.contacts import Contacts, border_contacts
from meshcone.quality.cracks import count_cracks
from meshcone.quality.defects import DefectCheck
from meshcone.quality.facing import orientation_of
from meshcone.quality.farthest import beyond, largest_at_vertices, largest_distance
from meshcone.quality.intersections import count_self_intersections
from meshcone.surface import Mesh, SurfaceTree, without_copies
from meshcone.surface.arrays import Bools, Floats, row_dot

# Distances may grow by this share and this much of the radius: what samples cannot tell apart.
_MEAN_SHARE, _P95_SHARE, _MAX_SHARE = 0.005, 0.02, 0.02
_P95_ROUNDING, _MAX_ROUNDING = 1e-3, 1e-4
# A place is worse where its distance grows by this share of the input's mean at least.
_FELT = 0.25
_MEAN, _LARGEST = "the mean", "the largest"
# Below this share of the radius a distance or a move is the rounding of the file's own numbers.
ROUNDING = 1e-7
# Two means that differ by less than so many standard errors may differ by the samples alone.
STANDARD_ERRORS = 2.0


class HarmCheck:
    """A source and its reference, prepared to be held against answers.

    Args:
        source: in the reference's frame.
        reference: in its own frame.
        tree: closest points on the reference.
        intersection_pairs: pairs of faces that may be tested for self-intersections.
        distances: whether it counts that an answer is farther from the reference.

    Attributes:
        source: without the copies of faces that it stores twice.
        input: the source itself, held against itself.
    """

    def __init__(
        self,
        source: Mesh,
        reference: Mesh,
        tree: SurfaceTree,
        intersection_pairs: int,
        *,
        distances: bool = True,
    ) -> None:
        self._distances_count = distances
        source, _ = without_copies(source)
        reference, kept = without_copies(reference)
        self.source, self._most_pairs = source, intersection_pairs
        self._tree = tree if kept is None else SurfaceTree(reference)
        self._probes = Probes.of(source, reference)
        self._defects = DefectCheck(source, reference, self._probes.points, intersection_pairs)
        self.input = Examined(self, source)

    def examine(self, positions: Floats) -> Examined:
        """Look at the source at (n, 3) positions."""
        return Examined(self, self.source.moved_to(positions))

    def objections(self, positions: Floats) -> list[str]:
        """Say in what the source at (n, 3) positions is worse than the source, a clause each."""
        return self.examine(positions).objections

    def farther(self, now: Examined) -> list[str]:
        """Say which distances have grown beyond what is allowed."""
        return [
            f"{what} distance grows from {before:.3g} to {after:.3g} of the radius"
            for what, (before, after) in self._grown(now).items()
        ]

    def _grown(self, now: Examined) -> dict[str, tuple[float, float]]:
        """Which distances have grown beyond what is allowed, from what to what."""
        if not self._distances_count:
            return {}
        was, reached = self.input.distances, now.distances
        largest = was.max
        if now.largest > _allowed(largest, _MAX_SHARE, _MAX_ROUNDING):
            largest = self.input.largest  # which is at least that of its samples
        grown = {
            what: (before, after)
            for what, before, after, share, rounding in (
                (_MEAN, was.mean, reached.mean, _MEAN_SHARE, 0.0),
                ("the 95th percentile of the", was.p95, reached.p95, _P95_SHARE, _P95_ROUNDING),
                (_LARGEST, largest, now.largest, _MAX_SHARE, _MAX_ROUNDING),
            )
            if after > _allowed(before, share, rounding)
        }
        lost = self.gain(now)
        if lost.mean < -(STANDARD_ERRORS * lost.error + ROUNDING):  # no luck of the samples
            grown[_MEAN] = was.mean, reached.mean
        return grown

    def gain(self, now: Examined) -> Gain:
        """How much closer than the input a mesh is, and what of it may be luck of the samples."""
        gained = self.input.distances.sampled - now.distances.sampled
        variance = gained.var(axis=1).sum() / (2 * gained.size)  # of the mean of two means
        return Gain(float(gained.mean()), float(np.sqrt(variance)))

    def defects(self, now: Examined) -> list[str]:
        """Say which defects there are more of than is allowed."""
        found = [defect.clause for defect in self._defects.found(self.input, now)]
        return found + self._torn_open(now)

    def _torn_open(self, now: Examined) -> list[str]:
        """Say whether vertices have left the borders that they lie on, which none may."""
        opened, gaps = self._contacts.opened(now.mesh.vertices)
        if not opened.any():
            return []
        widest = gaps[opened].max()
        return [f"a border opens by {widest:.3g} of the radius where another lies on it"]

    def places(self, now: Examined) -> Bools:
        """Find the vertices around what speaks against a mesh, (n,).

        Of what the reference's side misses, the source's own closest faces count. Where only the
        largest distance speaks against it, only what is that far away counts.
        """
        faces = np.zeros(len(self.source.faces), dtype=bool)
        vertices = np.zeros(len(self.source.vertices), dtype=bool)
        if grown := self._grown(now):
            was, reached = self.input.distances, now.distances
            limit = _allowed(self.input.largest, _MAX_SHARE, _MAX_ROUNDING)
            if grown.keys() - {_LARGEST}:
                felt = max(_MAX_ROUNDING, _FELT * was.mean)
                there, back = reached.sampled > was.sampled + felt
            else:
                there, back = reached.sampled > limit
            faces[self._probes.faces[there]] = True
            missed = [self._probes.points[back]]
            if now.largest > limit:
                vertices[beyond(now.mesh, self._tree, limit).vertices] = True
                missed.append(beyond(self._tree.mesh, SurfaceTree(now.mesh), limit).points)
            faces[SurfaceTree(self.source).closest(np.concatenate(missed)).faces] = True
        if defects := self._defects.found(self.input, now):
            there = np.any([defect.there for defect in defects], axis=0)
            faces |= self._defects.amiss(self.input, now, there)
        opened, _ = self._contacts.opened(now.mesh.vertices)
        vertices[self._contacts.touching(opened)] = True
        vertices[self.source.faces[faces]] = True
        return vertices

    @cached_property
    def _contacts(self) -> Contacts:
        return border_contacts(self.source, self._most_pairs)

    @cached_property
    def _source_agreement(self) -> Floats:
        return self._agreement(self.source)

    def measured(self, mesh: Mesh) -> Distances:
        """Measure the distances of a mesh with the source's faces."""
        return self._probes.measured(mesh, self._tree)

    def farthest(self, mesh: Mesh, least: float) -> float:
        """Return the largest distance of vertices, edges and faces both ways, or the least."""
        there = largest_distance(mesh, self._tree, least)
        return largest_distance(self._tree.mesh, SurfaceTree(mesh), there)

    def farthest_vertex(self, mesh: Mesh) -> float:
        """Return the largest distance of a vertex of either mesh from the other."""
        there = largest_at_vertices(mesh, self._tree)
        return max(there, largest_at_vertices(self._tree.mesh, SurfaceTree(mesh)))

    def shrunken(self, mesh: Mesh) -> Bools:
        """Find the faces of connected pieces that have fallen to a fraction of their area, (m,)."""
        return self._defects.shrunken(mesh)

    def crossing(self, mesh: Mesh) -> int | None:
        """Count pairs of faces that pass through each other; None where that is too much."""
        return count_self_intersections(mesh, self._most_pairs)

    def cracks(self, mesh: Mesh) -> int | None:
        """Count edges of open borders along other borders; None where that is too much."""
        return count_cracks(mesh, self._most_pairs)

    def opposed(self, mesh: Mesh) -> Bools:
        """Find faces that turn their backs on the closest triangle of the reference, (m,)."""
        known = self._source_agreement
        orientation = orientation_of(self.source, self._tree.mesh, float(np.mean(known)))
        agreement = known if mesh is self.source else self._agreement(mesh)
        return orientation * agreement < 0

    def _agreement(self, mesh: Mesh) -> Floats:
        """Return the cosine between each face and the closest face of the reference, (m,)."""
        closest = self._tree.closest(mesh.corners.mean(axis=1))
        return row_dot(mesh.face_normals, self._tree.mesh.face_normals[closest.faces])


class Examined:
    """One mesh held against the input; each count is made when it is first asked for."""

    def __init__(self, check: HarmCheck, mesh: Mesh) -> None:
        self._check, self.mesh = check, mesh

    @cached_property
    def distances(self) -> Distances:
        """How far samples of it are from the reference, and samples of that from it."""
        return self._check.measured(self.mesh)

    @cached_property
    def largest(self) -> float:
        """The largest distance of samples, vertices, edges and faces, both ways, in the radius."""
        return self._check.farthest(self.mesh, self.distances.max)

    @cached_property
    def farthest_vertex(self) -> float:
        """The largest distance of samples and vertices, which has less to do with single faces."""
        return max(self.distances.max, self._check.farthest_vertex(self.mesh))

    @cached_property
    def opposed(self) -> int:
        """Faces that turn their backs on the closest triangle of the reference."""
        return int(np.count_nonzero(self.opposed_faces))

    @cached_property
    def opposed_faces(self) -> Bools:
        """(m,) which faces turn their backs on the closest triangle of the reference."""
        return self._check.opposed(self.mesh)

    @cached_property
    def crossing(self) -> int | None:
        """Pairs of faces that pass through each other; None where counting takes too long."""
        return self._check.crossing(self.mesh)

    @cached_property
    def cracks(self) -> int | None:
        """Edges of open borders that lie along others; None where counting takes too long."""
        return self._check.cracks(self.mesh)

    @cached_property
    def shrunken(self) -> Bools:
        """(m,) which faces belong to pieces that lose most of their area."""
        return self._check.shrunken(self.mesh)

    @property
    def amiss(self) -> int:
        """Opposed faces and crossing pairs together."""
        return self.opposed + (self.crossing or 0)

    @cached_property
    def objections(self) -> list[str]:
        """In what it is worse than the input, a clause each; defects where distances are not."""
        return self._check.farther(self) or self._check.defects(self)


def _allowed(before: float, share: float, rounding: float) -> float:
    return (1 + share) * before + rounding
