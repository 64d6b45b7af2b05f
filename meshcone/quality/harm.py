"""Whether an answer is worse than its input anywhere it counts.

A mean over samples can fall while one corner is torn off, faces turn over or pass through
each other. So an answer is held against its input on several counts at once, over samples
drawn with seeds that nothing else uses: what was minimised must not be its own judge.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from meshcone.quality.contacts import Contacts, border_contacts
from meshcone.quality.cracks import count_cracks
from meshcone.quality.facing import orientation_of
from meshcone.quality.intersections import count_self_intersections, self_intersections
from meshcone.surface import Mesh, SurfaceTree, sample_surface, without_copies
from meshcone.surface.arrays import Bools, Floats, Ints, row_dot
from meshcone.surface.closest import barycentric_weights

_SAMPLES = 8000
_SEED = 2**31 + 11  # options allow seeds up to 2³¹ − 1: no caller's samples are these
# Distances may grow by this share and this much of the radius: what samples cannot tell apart.
_MEAN_SHARE, _P95_SHARE, _MAX_SHARE = 0.005, 0.02, 0.02
_P95_ROUNDING, _MAX_ROUNDING = 1e-3, 1e-4
# A place is worse where its distance grows by this share of the input's mean at least.
_FELT = 0.25
# Defects of the mesh itself may grow by this many, of a small mesh by fewer, or by this share
# of its faces; by more only where the mean distance falls to a quarter.
_FEWEST_DEFECTS, _FEW_SHARE = 4, 0.05
_DEFECT_SHARE, _SHARE_IF_MUCH_CLOSER, _MUCH_CLOSER = 0.005, 0.05, 0.25

_MEAN, _LARGEST = "the mean", "the largest"
# Below this share of the radius a distance or a move is the rounding of the file's own numbers.
ROUNDING = 1e-7
# Two means that differ by less than so many standard errors may differ by the samples alone.
STANDARD_ERRORS = 2.0


@dataclass(frozen=True)
class Distances:
    """Of samples, in both directions; relative to the radius.

    Attributes:
        sampled: (2, k) of each sample, from the mesh and from the reference.
    """

    mean: float
    p95: float
    max: float
    sampled: Floats = field(repr=False, compare=False)


@dataclass(frozen=True)
class Gain:
    """How much closer an answer is than its input, over the same places on both.

    Attributes:
        mean: of the differences, relative to the radius; negative where it is farther away.
        error: standard error of that mean over the samples.
    """

    mean: float
    error: float


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
        self.source, self._pairs = source, intersection_pairs
        self._tree = tree if kept is None else SurfaceTree(reference)
        self._samples = sample_surface(reference, _SAMPLES, _SEED).in_space().points
        drawn = sample_surface(source, _SAMPLES, _SEED + 1).in_space()
        self._faces = drawn.faces
        self._weights = barycentric_weights(drawn.points, source, drawn.faces)
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
        was, found = self.input, []
        much_closer = now.distances.mean <= _MUCH_CLOSER * was.distances.mean
        share = _SHARE_IF_MUCH_CLOSER if much_closer else _DEFECT_SHARE
        few = min(_FEWEST_DEFECTS, int(_FEW_SHARE * len(self.source.faces)))
        allowed = max(few, int(share * len(self.source.faces)))
        turned = self._growth(now, lambda examined: examined.opposed, allowed)
        if turned > allowed:
            found.append(f"{turned:,} more faces turn their backs on the reference")
        more = self._growth(now, lambda examined: examined.crossing, allowed)
        # Where the reference's own faces pass through each other, so will those that follow it.
        if more > allowed and more > self._crossing_of_reference - (was.crossing or 0):
            found.append(f"{more:,} more pairs of faces pass through each other")
        torn = self._growth(now, lambda examined: examined.cracks, allowed)
        if torn > allowed:
            found.append(f"{torn:,} more edges of open borders lie along another border")
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
            faces[self._faces[there]] = True
            missed = [self._samples[back]]
            if now.largest > limit:
                ours, theirs = self.beyond(now.mesh, limit)
                vertices[ours] = True
                missed.append(self._tree.mesh.vertices[theirs])
            faces[SurfaceTree(self.source).closest(np.concatenate(missed)).faces] = True
        if self.defects(now):
            faces |= now.opposed_faces & ~self.input.opposed_faces
            faces[self._newly_crossing(now)] = True
        opened, _ = self._contacts.opened(now.mesh.vertices)
        vertices[self._contacts.touching(opened)] = True
        vertices[self.source.faces[faces]] = True
        return vertices

    def _newly_crossing(self, now: Examined) -> Ints:
        """Faces that pass through others which they did not pass through before."""
        before, after = (self_intersections(mesh, self._pairs) for mesh in (self.source, now.mesh))
        if before is None or after is None:
            return np.empty(0, dtype=np.int64)
        count = len(self.source.faces)
        known = before[:, 0] * count + before[:, 1]
        return after[~np.isin(after[:, 0] * count + after[:, 1], known)].ravel()

    def _growth(self, now: Examined, count: _Count, allowed: int) -> int:
        """How many more there are than of the input, which need not be looked at for a few."""
        after = count(now)
        if after is None or after <= allowed:
            return 0
        before = count(self.input)
        return 0 if before is None else after - before

    @cached_property
    def _contacts(self) -> Contacts:
        return border_contacts(self.source, self._pairs)

    @cached_property
    def _crossing_of_reference(self) -> int:
        return self.crossing(self._tree.mesh) or 0

    @cached_property
    def _source_agreement(self) -> Floats:
        return self._agreement(self.source)

    def measured(self, mesh: Mesh) -> Distances:
        """Measure the distances of a mesh with the source's faces."""
        # The same places on the mesh before and after: areas change, and a part that the
        # reference lacks would weigh more beside one that has become smooth.
        corners = mesh.vertices[mesh.faces[self._faces]]
        carried = np.einsum("ij,ijk->ik", self._weights, corners)
        there = self._tree.closest(carried).distances
        back = SurfaceTree(mesh).closest(self._samples).distances
        return Distances(
            mean=float((there.mean() + back.mean()) / 2),
            p95=float(max(np.quantile(there, 0.95), np.quantile(back, 0.95))),
            max=float(max(there.max(), back.max())),
            sampled=np.stack([there, back]),
        )

    def corners(self, mesh: Mesh) -> float:
        """Return the largest distance of a vertex of either mesh from the other."""
        return float(max(distances.max() for _, distances in self._corner_distances(mesh)))

    def beyond(self, mesh: Mesh, limit: float) -> tuple[Ints, Ints]:
        """Find the vertices of the mesh, and of the reference, that are farther from the other."""
        ours, theirs = self._corner_distances(mesh)
        return ours[0][ours[1] > limit], theirs[0][theirs[1] > limit]

    def _corner_distances(self, mesh: Mesh) -> tuple[tuple[Ints, Floats], tuple[Ints, Floats]]:
        used, known = mesh.used_vertices, self._tree.mesh.used_vertices
        there = self._tree.closest(mesh.vertices[used]).distances
        back = SurfaceTree(mesh).closest(self._tree.mesh.vertices[known]).distances
        return (used, there), (known, back)

    def crossing(self, mesh: Mesh) -> int | None:
        """Count pairs of faces that pass through each other; None where that is too much."""
        return count_self_intersections(mesh, self._pairs)

    def cracks(self, mesh: Mesh) -> int | None:
        """Count edges of open borders along other borders; None where that is too much."""
        return count_cracks(mesh, self._pairs)

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
        """The largest distance of samples and vertices, both ways, relative to the radius."""
        return max(self.distances.max, self._check.corners(self.mesh))

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

    @property
    def amiss(self) -> int:
        """Opposed faces and crossing pairs together."""
        return self.opposed + (self.crossing or 0)

    @cached_property
    def objections(self) -> list[str]:
        """In what it is worse than the input, a clause each; defects where distances are not."""
        return self._check.farther(self) or self._check.defects(self)


_Count = Callable[[Examined], int | None]


def _allowed(before: float, share: float, rounding: float) -> float:
    return (1 + share) * before + rounding
